"""Modules by the names that they had in version 0.1.0, and where they are now."""

MOVED = {
    "actions": "drives.drive",
    "arm26": "ecosystem.bare_arm",
    "batch": "world.batch",
    "canvas": "rendering.canvas",
    "claims": "world.work_sharing",
    "command_kernel": "patient.static_optimisation",
    "control_period": "world.control_period",
    "distributions": "patient.distributions",
    "effort": "patient.effort",
    "episode": "world.episode",
    "events": "tasks.limits",
    "exoskeleton": "ecosystem.exoskeleton",
    "fatigue": "patient.fatigue",
    "figures": "paper.figures",
    "fitting": "world.scaling",
    "gym_machine": "ecosystem.gym_machine",
    "human": "ecosystem.arm",
    "jit": "kernels",
    "lift_env": "envs.elbow_lift",
    "lift_settings": "envs.settings",
    "measures": "paper.summary",
    "motor_command": "patient.motor_command",
    "need": "patient.ability",
    "observations": "tasks.observer",
    "opening": "world.reset",
    "orderings": "paper.statements",
    "panels": "rendering.panels",
    "picture": "rendering.picture",
    "plant": "tables",
    "population": "patient.population",
    "readout": "world.readout",
    "repetition": "tasks.movement",
    "rewards": "tasks.rewards",
    "rig": "world.world",
    "sb3": "envs.elbow_lift_sb3",
    "scenarios": "paper.scenarios",
    "scene": "rendering.scene",
    "shapes": "rendering.shapes",
    "slacking": "patient.slacking",
    "soak": "envs.soak",
    "staging": "rendering.episode_scene",
    "start_kernel": "world.rest_pose",
    "tune": "paper.tuning",
    "vector_env": "envs.vector_env",
}

_KERNEL = "Compiled code is written with exo_env.kernels now: tables in small tuples by owner (exo_env/tables.py)."
_MUSCLES = "Muscles come from the arm: exo_env.ecosystem.arm.Arm().muscles, .signs."
_ROPES = "Ropes come from the device: Exoskeleton.ropes, .lifting_rope, .lowering_rope."
_READINGS = "Readings and channels are declared by a task: exo_env.tasks.channels, exo_env.tasks.lift."

NAMES = {
    "actions": {
        "RopeTension": "drives.rope_tension:RopeTension",
        "PidSetpoint": "drives.pid_setpoint:PidSetpoint",
        "REFERENCE": "ecosystem.ecosystem:REFERENCE",
        "ASSISTANCE": "ecosystem.ecosystem:ASSISTANCE",
        "DRIVES": "An environment has its drives: ElbowLiftEnv.drives.",
        "drive": "An environment has its drives: ElbowLiftEnv.drives[mode](**settings).",
    },
    "control_period": {
        "READING": _READINGS,
        "PLANT": _KERNEL,
        "Plant": _KERNEL,
        "device_share": "tasks.elbow:device_share",
    },
    "effort": {
        "N": _MUSCLES,
        "SIGN": _MUSCLES,
        "Effort": "A patient's effort is an EffortState that step_effort advances.",
        "STATE": "The state is a named tuple: EffortState.",
    },
    "events": {
        "SOLVER": "tasks.task:SOLVER",
        "event_code": "It is called exceeded now.",
        "event": "It is limit_sentence now.",
    },
    "exoskeleton": {
        **{
            name: f"ecosystem.worn_exoskeleton:{name}"
            for name in (
                "WornExoskeleton",
                "Misalignment",
                "GuideKind",
                "link_axes",
                "UPPER",
                "LOWER",
                "HINGE",
                "GUIDE",
                "PID",
            )
        },
        "AGONIST": _ROPES,
        "ANTAGONIST": _ROPES,
        "RopeName": _ROPES,
    },
    "fitting": {
        "Fitting": "world.scaling:Scaling",
        "fitting": "It is scaling_of(ecosystem, drive) now, in exo_env.world.scaling.",
    },
    "human": {
        "MUSCLES": _MUSCLES,
        "FLEXORS": _MUSCLES,
        "EXTENSORS": _MUSCLES,
        "GRIP": "The grip stands in the subject's file, configs/subject/arm26.yaml.",
        **{name: f"ecosystem.person:{name}" for name in ("Person", "MASS_0", "HEIGHT_0")},
    },
    "lift_settings": {"TIME": "envs.elbow_lift:TIME"},
    "observations": {
        **{name: f"tasks.channels:{name}" for name in ("Channel", "Imperfection", "Slice")},
        "imperfect": "tasks.noise:imperfect",
        "GROUPS": _READINGS,
        "TRUTH": _READINGS,
        "TRUTH_SIZE": _READINGS,
        "UNITS": "Units stand with the fields: exo_env.traits.unit_of.",
    },
    "opening": {"SETTING": _KERNEL, "Setting": _KERNEL, "open_episode": "It is begin_episode now."},
    "repetition": {
        name: f"tasks.repetition:{name}"
        for name in (
            "Repetition",
            "Repetitions",
            "MOVEMENT",
            "MOVED",
            "MOST_REPETITIONS",
            "LOWEST",
            "HIGHEST",
            "put_pieces",
        )
    },
    "rewards": {"TERMS": "Terms are the fields of Weights: exo_env.tasks.rewards.TERM._fields."},
    "rig": {"Rig": "world.world:PatientWorld"},
    "staging": {"staged": "rendering.episode_scene:scene_of"},
    "start_kernel": {"put_start": "It is put_rest now.", "handle_angle": "ecosystem.gym_machine:handle_angle"},
    "vector_env": {"ElbowLiftVectorEnv": "envs.elbow_lift:ElbowLiftVectorEnv"},
    "ecosystem": {
        **{name: f"ecosystem.ecosystem:{name}" for name in ("Ecosystem", "Proprioception", "REFERENCE", "ASSISTANCE")},
        "MUSCLE_COMPONENTS": "ecosystem.sensors:MUSCLE_COMPONENTS",
    },
    "patient": {
        **{name: f"patient.patient:{name}" for name in ("Patient", "FIELDS", "PATIENT", "LONGEST_DELAY", "fields_of")},
        **{name: f"ecosystem.person:{name}" for name in ("Sex", "SEXES")},
    },
    "rendering": {"Renderer": "rendering.renderer:Renderer"},
}
"""By old module, names that are elsewhere than the rest of it, or what replaces them. The last three modules are
folders now."""
