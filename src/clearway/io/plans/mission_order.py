"""The order in which the entries of a plan are flown: jumps followed, loops bounded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from clearway.io.plans.plan_items import Item, Jump, Step, Tag

MOST_FLOWN = 20_000
"""Items of a flight; autopilots hold a few thousand."""
MOST_STEPS = 400_000
"""Entries passed on the way, jumps too."""
ENDLESS = -1
ENDLESS_REPEATS = 1
"""How often a loop without end is flown again before the flight goes on."""


@dataclass(slots=True)
class MissionOrder:
    """Items in the order of flight, and what is to be stated about it."""

    items: list[Item] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


def in_flown_order(steps: Sequence[Step]) -> MissionOrder:
    """Follow the jumps of a plan as ArduPilot and PX4 do.

    Every jump keeps one count for the whole flight: an inner loop that is used up stays so when an
    outer one comes round again. A loop without end is flown `ENDLESS_REPEATS` times more, and the
    flight goes on after it. What stands after a return or a loiter without end is not flown.

    Problems name the jump where a target does not exist, a jump leads to itself, a loop without
    end leads nowhere, or more than `MOST_FLOWN` items would be flown.
    """
    order = MissionOrder()
    targets = {
        at: _target_of(step.does, at, steps, order.problems)
        for at, step in enumerate(steps)
        if isinstance(step.does, Jump)
    }
    if order.problems:
        return order
    left = {at: _repeats(steps, at, target, order.notes) for at, target in targets.items()}
    flown, at = set(), 0
    for _ in range(MOST_STEPS):
        if at >= len(steps) or (targets and len(order.items) > MOST_FLOWN):
            break
        does = steps[at].does
        if isinstance(does, Jump):
            forward = targets[at] > at and does.repeats == ENDLESS
            again = forward or left[at] > 0
            left[at] -= again
            at = targets[at] if again else at + 1
            continue
        if isinstance(does, Item):
            order.items.append(does)
            flown.add(at)
            if does.last:
                _note_end(steps, at, flown, order.notes)
                return order
        at += 1
    if at < len(steps):
        jump = max(targets, key=lambda one: _count(steps[one]), default=None)
        place = "" if jump is None else f"{_place(steps[jump])}: with its repeats "
        order.problems.append(
            f"{place}more than {MOST_FLOWN:,} items would be flown; valid: fewer repeats, or the "
            "plan in parts"
        )
    return order


def _target_of(does: Jump, at: int, steps: Sequence[Step], problems: list[str]) -> int:
    """Place in `steps` that a jump leads to; problems grow where there is none."""
    what = f"tag {does.target}" if does.tagged else f"item {does.target}"
    jumps = f"{does.place}: item {steps[at].number} jumps to {what}"
    places: dict[int, int] = {}
    for number, step in enumerate(steps):
        if not does.tagged:
            places.setdefault(step.number, number)
        elif isinstance(step.does, Tag):
            places.setdefault(step.does.value, number)
    place = places.get(does.target)
    if place is None:
        kind = "tags" if does.tagged else "items"
        valid = f"{kind} {min(places)} to {max(places)}" if places else f"no {kind}"
        problems.append(f"{jumps}, which is not in the plan; valid: {valid}")
        return at
    if place == at:
        problems.append(f"{jumps}, which is itself; valid: an item to fly to")
    elif does.repeats == ENDLESS and place < at and not _leads(steps[place:at]):
        problems.append(f"{jumps} for ever, and nothing between them leads anywhere")
    return place


def _leads(steps: Sequence[Step]) -> bool:
    return any(isinstance(step.does, Item) for step in steps)


def _repeats(steps: Sequence[Step], at: int, target: int, notes: list[str]) -> int:
    """How often a jump is taken; notes grow by what it does."""
    does, number = steps[at].does, steps[target].number
    assert isinstance(does, Jump)
    if does.repeats == ENDLESS and target < at:
        notes.append(
            f"{does.place}: jumps back to item {number} for ever: taken {ENDLESS_REPEATS} x, "
            "then the flight goes on after it"
        )
        return ENDLESS_REPEATS
    if does.repeats:
        often = "whenever it is reached" if does.repeats == ENDLESS else f"{does.repeats} x"
        notes.append(f"{does.place}: jumps to item {number}, {often}")
    else:
        notes.append(f"{does.place}: jumps to item {number}, 0 x: never taken")
    return does.repeats


def _note_end(steps: Sequence[Step], at: int, flown: set[int], notes: list[str]) -> None:
    after = [
        place for place, step in enumerate(steps)
        if place > at and place not in flown and isinstance(step.does, Item)
    ]  # fmt: skip
    if after:
        notes.append(
            f"{_place(steps[at])}: the mission ends there; {len(after)} x item to fly to after "
            "it left out"
        )


def _count(step: Step) -> int:
    return step.does.repeats if isinstance(step.does, Jump) else 0


def _place(step: Step) -> str:
    return step.does.place if isinstance(step.does, (Item, Jump)) else f"item {step.number}"
