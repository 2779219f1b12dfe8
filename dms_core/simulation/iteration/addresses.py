"""Addresses of all parts of a step, compiled or loaded from disk here."""

from __future__ import annotations

from functools import cache

import numpy as np

from dms_core.compiled import side_by_side
from dms_core.compiled.calls import PART, address
from dms_core.simulation import initial_rates, step_control
from dms_core.simulation.iteration import evaluation, implicit_stage
from dms_core.simulation.iteration.parts import ADVANCE, PARTS, RATES, RESTART, STAGE, STEP, Parts
from dms_core.simulation.methods import radau5, radau_matrices


@cache
def part_addresses(radau: bool = False) -> np.ndarray:
    """Addresses in the order of `parts.Parts`, shape (len(PARTS),); constant, shared by all worlds of a method.

    Those of Radau IIA are compiled where `radau` asks for them, and 0 elsewhere. What builds on the others is compiled
    by a second process at the same time, if it is registered there.
    """
    found = Parts(
        **{name: address(getattr(evaluation, name), PART) for name in Parts._fields[: PARTS.solve_stage]},
        solve_stage=address(implicit_stage.solve_stage, STAGE),
        consistent_rates=address(initial_rates.consistent_rates, RATES),
        stage_rates=address(initial_rates.stage_rates, RATES),
        jump_rates=address(initial_rates.jump_rates, RATES),
        restart=address(step_control.restart_method, RESTART),
        advance=address(step_control.advance_method, ADVANCE),
        radau_matrices=address(radau_matrices.radau_matrices, PART) if radau else 0,
        radau_solutions=address(radau_matrices.radau_solutions, PART) if radau else 0,
        radau5_step=address(radau5.radau5_step, STEP) if radau else 0,
    )
    for work in side_by_side.registered():
        side_by_side.wait_for(work)
    return np.array(found, np.int64)
