"""One island of bodies over a step, or a part of it: by the pile tier, or exactly, smooth or struck."""

from __future__ import annotations

import numpy as np

from ..contacts.located import NONE, SWINGING, any_lasts, leave_open, located_last, mark_located
from ..contacts.prediction import list_touching, measure_end, newly_loaded, sort_out
from ..contacts.turning import quiet_span, turning_speed
from ..jit import call_stage, kernel, stage
from ..memory import bodies_of, fields_of, header_at, report_of, rest_of, starts_of, table, traits_of, workspace_at
from ..model import (
    BODY_STATE,
    CONTACT,
    DULL,
    LAST,
    LIVELY,
    TO_IMPACT,
    WHOLE,
)
from ..solver.exact import NEEDS_MEMORY
from .creep import add_creep, note_sticking
from .energy import energy_excess, is_jammed, stop, take_back
from .impact import acts_at_once, end_impact, forget_impulses, prepare_impact
from .landings import PAIR, worth_locating
from .lasting import end_lasting, prepare_lasting, settle_where_foreseen
from .overlap import PROJECTION_TOLERANCE, overlaps, prepare_projection, push_apart
from .places import (
    FORESEEN,
    MOST_PREDICTIONS,
    asks,
    came_true,
    closes,
    closes_by_end,
    expect_on_way,
    expect_steady,
    expect_supported,
    predict_places,
)
from .rebound import rebound
from .solving import FULL, GAVE_UP, SOLVED, STRIKES, solve_velocities, solver_memory
from .standing import keep_standing, note_standing, stands_still
from .stillness import let_rest


@stage
def step_islands(address, workspace_address, world):
    """From contacts to the states at the end of this part of the step (``ends``); return False if the solver needs
    more memory.
    """
    workspace = workspace_at(workspace_address)
    workspace.waiting = 0
    workspace.calm = workspace.span
    for island in range(workspace.num_islands):
        if not _step_island(address, workspace_address, world, island):
            return 0
    return 1


@kernel
def _step_island(address, workspace_address, world, island):
    """Advance the bodies of one island to the end of this part; return False if the solver needs more memory."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    order = table(workspace.order, workspace.order_size, np.int64)
    first, last = _range(workspace.island_starts, island)
    if workspace.part == WHOLE and stands_still(contacts, order, first, last):
        _stand(address, workspace_address, world, island)
        return True
    first_body, last_body = _range(workspace.body_starts, island)
    crowd = header.step_pile != 0 and last_body - first_body > 1
    struck, calm = sort_out(workspace.span, contacts, order, first, last, header.time_step * header.events, crowd)
    few = last_body - first_body <= PAIR
    if header.events == 1 and few and calm == workspace.span and any_lasts(contacts, order, first, last):
        calm = _quiet_span(address, workspace_address, world, island)
    workspace.calm = min(workspace.calm, calm)
    workspace.budget = header.max_iterations
    strikes = 1 if struck else 0
    if header.step_pile != 0 and call_stage(header.step_pile, address, workspace_address, world, island, strikes) == 1:
        return True
    outcome = _step_exactly(address, workspace_address, world, island, struck, calm < workspace.span)
    if outcome == GAVE_UP:
        call_stage(header.step_pile, address, workspace_address, world, island, strikes)
    if outcome == STRIKES and call_stage(header.step_pile, address, workspace_address, world, island, 1) == 0:
        outcome = _step_exactly(address, workspace_address, world, island, True, calm < workspace.span)
    return outcome != FULL


@kernel
def _quiet_span(address, workspace_address, world, island):
    """[s] in which no body of an island turns by more than is smooth, or all of this part."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    starts = starts_of(header, workspace)
    members = table(workspace.island_bodies, workspace.island_bodies_size, np.int64)
    first_body, last_body = _range(workspace.body_starts, island)
    fastest = 0.0
    for index in range(first_body, last_body):
        handle = members[index]
        fastest = max(fastest, turning_speed(bodies[handle], starts[handle]))
    quiet = quiet_span(fastest, header.time_step)
    return workspace.span if workspace.span <= 1.1 * quiet else quiet


@kernel
def _stand(address, workspace_address, world, island):
    """The step of an island that it leaves as it is."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    starts = starts_of(header, workspace)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    order = table(workspace.order, workspace.order_size, np.int64)
    members = table(workspace.island_bodies, workspace.island_bodies_size, np.int64)
    first, last = _range(workspace.island_starts, island)
    first_body, last_body = _range(workspace.body_starts, island)
    worst = keep_standing(starts, contacts, order, first, last, members, first_body, last_body, ends)
    table(workspace.waits, workspace.waits_size, np.int64)[island] = 0
    report = report_of(header, world)
    report.residual = max(report.residual, rest_of(header, world)[members[first_body]].residual)
    report.penetration = max(report.penetration, worst)


@kernel
def _step_exactly(address, workspace_address, world, island, struck, swings):
    """The same by the exact tier: SOLVED, FULL if the solver needs more memory, or, and nothing was done, GAVE_UP or
    STRIKES, if something turns out to close in an island of a crowd.

    ``swings``: a contact that rests turns so far that it lasts only for a part of the step.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    starts = starts_of(header, workspace)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    predicted = table(workspace.predicted, header.num_bodies, BODY_STATE)
    working = table(workspace.working, header.num_bodies, BODY_STATE)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    sums = table(workspace.sums, (header.num_bodies, 6), np.float64)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    order = table(workspace.order, workspace.order_size, np.int64)
    members = table(workspace.island_bodies, workspace.island_bodies_size, np.int64)
    first, last = _range(workspace.island_starts, island)
    first_body, last_body = _range(workspace.body_starts, island)
    time_step = workspace.span
    report = report_of(header, world)
    located = 0
    doubtful = False
    if workspace.part != LAST:
        landings = SWINGING
        if workspace.foreseen == 1:
            located = leave_open(contacts, order, first, last)
        else:
            if header.events == 1:
                landings = worth_locating(
                    header, bodies, starts, contacts, order, first, last, members, first_body, last_body
                )
            bound = table(workspace.bound, header.num_bodies, np.int64)
            located = mark_located(
                bodies, starts, flown, time_step, header.time_step, contacts, order, first, last, landings, bound
            )
        if swings and landings > NONE and workspace.part == WHOLE:
            located = max(located, DULL)
        lands = located == DULL
        if lands and last_body - first_body > 1 and header.step_pile == 0:
            # Not only stopped: a body may be set going, and meet others. In a crowd it does so in the next step.
            located = LIVELY
        if workspace.part == TO_IMPACT:
            last = located_last(contacts, order, first, last)
            struck, _ = sort_out(time_step, contacts, order, first, last, header.time_step * header.events, False)
        table(workspace.waits, workspace.waits_size, np.int64)[island] = located
        # What rests may never get to where it would fall without its support: first it is seen whether it does.
        doubtful = lands and workspace.part == WHOLE and not (struck or swings)
        doubtful = doubtful and any_lasts(contacts, order, first, last)
        if located > 0 and not doubtful:
            workspace.waiting += 1
            if workspace.part == WHOLE:
                return SOLVED
        if last == first:
            return SOLVED
    if workspace.foreseen == 1:
        bound = table(workspace.bound, header.num_bodies, np.int64)
        expect_on_way(members, first_body, last_body, bound, predicted, ends)
    else:
        expect_steady(starts, time_step, contacts, order, first, last, bodies, ends)
        if last_body - first_body == 1:
            expect_supported(
                starts, time_step, header.time_step, contacts, order, first, last, bodies, members[first_body], ends
            )
    crowded = header.step_pile != 0 and traits_of(header, world).restitution == 0 and last_body - first_body > 1
    hands_over = crowded and not struck and located == 0 and workspace.part == WHOLE
    touching = table(workspace.touching, workspace.touching_size, np.int64)
    num_touching = list_touching(contacts, order, first, last, touching)
    foreseen = False
    predictions = 0
    while not (struck or foreseen):
        predict_places(
            bodies, starts, flown, ends, time_step, contacts, order, first, last, members, first_body, last_body,
            predicted, working,
        )  # fmt: skip
        if asks(contacts, order, first, last):
            call_stage(header.follow_contacts, address, workspace_address, world, first, last)
        struck = closes(contacts, order, first, last, time_step, predictions)
        if struck:
            break
        prepare_lasting(
            bodies, flown, time_step, header.time_step, contacts, touching, num_touching, sums, members, first_body,
            last_body, predicted, working, ends,
        )  # fmt: skip
        listed = workspace.touching
        outcome = solve_velocities(address, workspace_address, world, listed, num_touching, first_body, last_body)
        if outcome != SOLVED:
            return outcome
        struck = newly_loaded(contacts, touching, num_touching)
        if struck:
            break
        end_lasting(
            bodies, starts, flown, time_step, contacts, touching, num_touching, sums, members, first_body, last_body,
            working, ends,
        )  # fmt: skip
        struck = closes_by_end(predicted, ends, contacts, order, first, last)
        if struck:
            break
        predictions += 1
        foreseen = predictions == MOST_PREDICTIONS
        if came_true(predicted, ends, time_step, contacts, touching, num_touching):
            foreseen = True
            if workspace.foreseen == 1 and predictions == 1:
                settle_where_foreseen(bodies, FORESEEN, flown, sums, members, first_body, last_body, predicted, ends)
    if struck and hands_over:
        return STRIKES
    if not struck:
        rows, _, blocks, _ = solver_memory(workspace)
        note_sticking(time_step, contacts, touching, num_touching, rows)
        let_rest(
            bodies, starts, header.tolerance, contacts, order, first, last, sums, members, first_body, last_body, ends
        )  # fmt: skip
        excess, struck = energy_excess(
            bodies, fields_of(header), starts, flown, ends, contacts, order, first, last, members, first_body, last_body
        )
        if struck:
            forget_impulses(contacts, order, first, last)
        elif excess > 0.0 and last_body - first_body == 1:
            handle = members[first_body]
            take_back(
                excess, bodies[handle], handle, starts[handle], working[handle], ends[handle], contacts, order, first,
                last, blocks,
            )  # fmt: skip
    if doubtful:
        if struck:
            workspace.waiting += 1
            return SOLVED
        table(workspace.waits, workspace.waits_size, np.int64)[island] = 0
    places = predicted
    if struck:
        places = starts
        prepare_impact(
            bodies, starts, flown, time_step, contacts, order, first, last, members, first_body, last_body, predicted,
            working,
        )  # fmt: skip
        acts_at_once(contacts, order, first, last)
        listed = workspace.order + 8 * first
        outcome = solve_velocities(address, workspace_address, world, listed, last - first, first_body, last_body)
        if outcome != SOLVED:
            return outcome
        end_impact(
            bodies, starts, flown, time_step, contacts, order, first, last, sums, members, first_body, last_body, ends
        )
        if traits_of(header, world).restitution == 1:
            outcome = rebound(
                address, workspace_address, world, time_step, contacts, order, first, last, starts, flown, sums,
                members, first_body, last_body, ends,
            )  # fmt: skip
            if outcome != SOLVED:
                return outcome
        if last_body - first_body == 1 and is_jammed(
            bodies, flown, contacts, order, first, last, members, first_body, last_body
        ):
            handle = members[first_body]
            stop(bodies[handle], handle, starts[handle], flown[handle], ends[handle], contacts, order, first, last)
    worst = measure_end(places, ends, contacts, order, first, last)
    projected = False
    if overlaps(contacts, order, first, last):
        rows, nodes, _, index = solver_memory(workspace)
        prepare_projection(
            bodies, ends, contacts, order, first, last, members, first_body, last_body, rows, nodes, index
        )
        workspace.tolerance = PROJECTION_TOLERANCE
        workspace.budget = header.max_iterations
        own, num_bodies = last - first, last_body - first_body
        if call_stage(header.solve_problem, address, workspace_address, own, num_bodies) == NEEDS_MEMORY:
            return FULL
        report.iterations += workspace.iterations
        push_apart(bodies, nodes, members, first_body, last_body, ends)
        projected = True
        worst = measure_end(places, ends, contacts, order, first, last)
    if not struck:
        add_creep(starts, ends, contacts, order, first, last)
        certified = predictions == 1 and not projected and workspace.part == WHOLE and workspace.iterations == 0
        note_standing(certified, starts, ends, contacts, order, first, last, members, first_body, last_body)
    # What is still to be located has been left out: where that leads is not what happens.
    if workspace.part != TO_IMPACT or located == 0:
        report.penetration = max(report.penetration, worst)
    return SOLVED


@kernel
def _range(address, number):
    """The entries ``number`` and ``number + 1`` of a table of integers."""
    pair = table(address + 8 * number, 2, np.int64)
    return pair[0], pair[1]
