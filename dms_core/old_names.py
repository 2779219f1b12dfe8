"""Modules by the names that they had in version 0.1.0, and where they are now."""

MOVED = {
    "assembly.arena": "compiled.arena",
    "assembly.calls": "compiled.calls",
    "assembly.entries": "compiled.entries",
    "assembly.welds": "assembly.elimination",
    "compilation": "compiled.compilation",
    "jit": "compiled.jit",
    "model.frames": "model.geometry.frames",
    "model.joint_angle": "model.geometry.angle",
    "model.ropes.path": "model.geometry.path",
    "model.rotations": "model.geometry.rotations",
    "model.sensed_angle": "model.geometry.sensed_angle",
    "model.separation": "model.geometry.separation",
    "output_file": "files.output_file",
    "simulation.initial_conditions": "assembly.start",
    "yaml_text": "files.yaml_text",
}
