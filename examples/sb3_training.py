"""How do I train with Stable-Baselines3 and evaluate on the same patients each time? With a cycle of episodes."""

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.vec_env import VecMonitor

from exo_env.envs.elbow_lift_sb3 import ElbowLiftVecEnv

SETTINGS = {"action_mode": "pid_setpoint", "episode_duration": 1.0}
worlds = VecMonitor(ElbowLiftVecEnv(8, patient="mixed", **SETTINGS))
# Four worlds of five episodes each, which come again and again: evaluations differ by the policy alone.
judges = VecMonitor(ElbowLiftVecEnv(4, patient="evaluation", cycle=5, **SETTINGS))
judges.seed(1000)
evaluation = EvalCallback(judges, n_eval_episodes=20, eval_freq=100, verbose=0)
model = PPO("MlpPolicy", worlds, n_steps=50, batch_size=100, seed=0, device="cpu")
model.learn(1600, callback=evaluation)
print(f"mean return on 20 episodes: {evaluation.last_mean_reward:.1f}")
judges.close()
worlds.close()

# Trainings worth the name: python -m agents train --config configs/agents/ppo.yml --out out/ppo
