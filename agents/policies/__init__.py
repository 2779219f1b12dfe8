"""Policies: the contract, the classical ones, and trained ones that run on NumPy.

from exo_agents.policies import find_policy

policy = find_policy("learned")      # or "pid", a folder of a trained one, or "module:Class" of your own
policy.reset(env)
action = policy(observation, info)
"""

from .baselines import POLICIES as POLICIES
from .learned import LearnedPolicy as LearnedPolicy
from .learned import find_policy as find_policy
from .learned import shipped_policies as shipped_policies
from .policy import Channels as Channels
from .policy import Policy as Policy
