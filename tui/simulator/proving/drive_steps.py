"""Steps for communication loss, saved settings, and blocks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from decimal import Decimal
from functools import partial

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.profile.toml_lines import TomlPath
from tui.drive.settings.memory_orders import eeprom_copy
from tui.drive.settings.writable import is_setting
from tui.drive.values import is_enumeration, is_field, raw_range, word_count
from tui.drive.words import is_word

from .bench_motion import STOP_SECONDS, need_reset, present_scale, running_chart, start_motor
from .proof_bench import ProofBench, ProofStep, Unproved, proof_step


def drive_steps(profile: Profile) -> Iterator[ProofStep]:
    """Test the reactions to communication loss, the memory and the blocks."""
    yield from _settings(profile)
    yield from _timeouts(profile)
    yield from _memory(profile)
    yield from _blocks(profile)


def _timeouts(profile: Profile) -> Iterator[ProofStep]:
    watch = profile.data.communication_fault
    if watch is None or not profile.data.charts:
        return
    at: TomlPath = ("communication_fault",)
    if not watch.reactions:
        yield proof_step(at, "communication loss trips the drive", partial(_lose, profile, None))
    for place, reaction in enumerate(watch.reactions):
        yield proof_step(
            (*at, "reactions", place),
            f"communication loss: {reaction.name}",
            partial(_lose, profile, place),
        )


def _lose(profile: Profile, place: int | None) -> None:
    watch, chart = profile.data.communication_fault, running_chart(profile)
    assert watch is not None
    bench = ProofBench(profile, chart or next(iter(profile.data.charts), None))
    parameter = profile[watch.timeout]
    scale = present_scale(bench, parameter) or Decimal(1)
    scale *= {"ms": Decimal("0.001"), "min": Decimal(60)}.get(parameter.unit, Decimal(1))
    raw = max(parameter.min or 0, math.ceil(1 / scale), 1)
    bench.drive.set(parameter.code, raw)
    reaction = watch.reactions[place] if place is not None else None
    if reaction is not None:
        bench.drive.set(watch.reaction, reaction.raw)
    runs = chart is not None and start_motor(bench, "forward")
    if not runs and watch.needs_write:
        return
    bench.ask(bytes([3, parameter.address >> 8, parameter.address & 0xFF, 0, 1]))
    bench.wait(float(raw * scale) + 0.5, silent=True)
    if reaction is not None and not reaction.trips:
        _need_no_trip(bench, runs=runs, keeps=reaction.motor_keeps_running or not runs)
        return
    if not bench.until(lambda: bench.state().kind == "fault", STOP_SECONDS, silent=True):
        raise Unproved(f"the drive shows {bench.state().state.name}, not a fault")
    if not bench.until(lambda: not bench.turns, STOP_SECONDS):
        raise Unproved("the motor still turns")
    word = profile.get(profile.data.faults.parameter)
    if word is not None and watch.fault is not None and bench.read(word) != watch.fault:
        raise Unproved(f"{word.code} shows {bench.read(word)}, not {watch.fault}")
    if any(order.id == "reset" for order in bench.chart.orders):
        bench.send("reset")
        need_reset(bench)


def _need_no_trip(bench: ProofBench, *, runs: bool, keeps: bool) -> None:
    still = bench.until(lambda: abs(bench.drive.motor.rotor) < 0.5, STOP_SECONDS, silent=True)
    if not keeps and not still:
        raise Unproved("the motor still turns")
    if runs and keeps and not bench.turns:
        raise Unproved("the motor does not turn any more")
    if bench.state().kind == "fault":
        raise Unproved("the drive is in fault")


LINE_QUANTITIES = frozenset({"line_address", "line_baud", "line_format"})
"""Settings that would end the exchange with the drive on the bench."""


def _settings(profile: Profile) -> Iterator[ProofStep]:
    """Write a setting of each group and kind of storage, and read it back."""
    line = {setting.parameter for setting in profile.data.link.settings}
    kinds: set[tuple[str, str, int]] = set()
    bench = ProofBench(profile, None)
    for index, parameter in enumerate(profile.parameters):
        kind = (parameter.group, parameter.storage, word_count(parameter))
        cuts = parameter.code in line or parameter.quantity in LINE_QUANTITIES
        fits = is_setting(profile, parameter) and not cuts
        if not fits or parameter.forbidden or parameter.resets_others or kind in kinds:
            continue
        if next(_others(profile, parameter), None) is not None:
            kinds.add(kind)
            title = f"setting {parameter.code} ({parameter.group}) is written and read back"
            step = partial(_write_setting, bench, parameter)
            yield proof_step(("parameters", index), title, step)


def _write_setting(bench: ProofBench, setting: Parameter) -> None:
    """Write values near the present one and the limits, until one is held; else raise Unproved."""
    present, (low, high) = bench.read(setting), raw_range(setting)
    near = [*_others(bench.profile, setting), present + 1, present - 1, high]
    fault = "no value within its limits differs from the present one"
    for raw in dict.fromkeys(raw for raw in near if low <= raw <= high and raw != present):
        try:
            bench.write(setting, raw)
        except Unproved as error:
            fault = f"{raw} is refused: {error}"
            continue
        if (read := bench.read(setting)) == raw:
            return
        fault = f"it is {read} after {raw} was written"
    raise Unproved(fault)


def _memory(profile: Profile) -> Iterator[ProofStep]:
    memory = profile.data.memory
    setting = _setting(profile)
    if setting is None:
        return
    if memory.enter is not None:
        step = partial(_enter, profile, setting)
        yield proof_step(("memory", "enter"), "settings take effect when entered", step)
    if memory.save is not None:
        yield proof_step(("memory", "save"), "settings are saved", partial(_save, profile, setting))
    if (copied := _setting(profile, copied=True)) is not None:
        at: TomlPath = ("parameters", profile.parameters.index(copied), "eeprom_address")
        step = partial(_save_copy, profile, copied)
        yield proof_step(at, "settings are saved at their EEPROM addresses", step)
    if memory.factory is not None and not memory.factory.groups:
        yield proof_step(
            ("memory", "factory"), "factory settings return", partial(_factory, profile, setting)
        )


def _setting(profile: Profile, *, copied: bool = False) -> Parameter | None:
    """Return a setting whose saving can be tested; if `copied`, one with an EEPROM address."""
    line = {setting.parameter for setting in profile.data.link.settings}
    for parameter in profile.parameters:
        if (
            parameter.access.startswith("rw")
            and parameter.storage in ("eeprom", "ram-until-saved")
            and parameter.factory is not None
            and (not copied or parameter.eeprom_address is not None)
            and parameter.code not in line
            and not (parameter.forbidden or parameter.holds or parameter.resets_others)
            and not (parameter.factory_by or is_field(parameter) or not is_word(parameter))
            and next(_others(profile, parameter), None) is not None
        ):
            return parameter
    return None


def _others(profile: Profile, parameter: Parameter) -> Iterator[int]:
    """Yield raw values other than the factory setting."""
    low, high = raw_range(parameter)
    names = profile.names(parameter)
    near = names if names and is_enumeration(parameter) else range(low, min(high, low + 2) + 1)
    yield from (raw for raw in near if raw != parameter.factory and low <= raw <= high)


def _change(bench: ProofBench, setting: Parameter) -> int:
    raw = next(_others(bench.profile, setting))
    bench.drive.set(setting.code, setting.factory or 0)
    bench.write(setting, raw)
    return raw


def _command_memory(bench: ProofBench, parameter: Parameter, raw: int, *, bit: bool) -> None:
    bench.write(parameter, bench.read(parameter) | raw if bit else raw)
    bench.wait(5)


def _enter(profile: Profile, setting: Parameter) -> None:
    bench, enter = ProofBench(profile, None), profile.data.memory.enter
    assert enter is not None
    raw = next(_others(profile, setting))
    bench.drive.set(setting.code, setting.factory or 0)
    bench.write_only(setting, raw)
    if bench.drive.registers.in_force(setting) == raw:
        raise Unproved(f"{setting.code} takes effect without {enter.parameter}")
    bench.write_only(profile[enter.parameter], enter.raw)
    if bench.drive.registers.in_force(setting) != raw:
        raise Unproved(f"{setting.code} has no effect after {enter.parameter} = {enter.raw}")


def _save(profile: Profile, setting: Parameter) -> None:
    order = profile.data.memory.save
    assert order is not None
    bench = ProofBench(profile, None)
    raw = _change(bench, setting)
    _command_memory(bench, profile[order.parameter], order.raw, bit=order.bit)
    if order.done is not None and not order.done.holds(bench.raws([order.done.parameter])):
        raise Unproved(f"{order.done.parameter} does not show completion")
    bench.drive.power_cycle()
    if bench.read(setting) != raw:
        raise Unproved(f"{setting.code} is {bench.read(setting)} after power-up, not {raw}")


def _save_copy(profile: Profile, setting: Parameter) -> None:
    """Write the address in RAM, then that in EEPROM; only the second survives a power cycle."""
    bench, copy = ProofBench(profile, None), eeprom_copy(setting)
    assert copy is not None
    raw = _change(bench, setting)
    bench.drive.power_cycle()
    if bench.read(setting) != setting.factory:
        raise Unproved(f"{setting.code} survives a power cycle without being saved")
    bench.write(copy, raw)
    bench.drive.power_cycle()
    for parameter in (setting, copy):
        if (read := bench.read(parameter)) != raw:
            address = parameter.address
            raise Unproved(f"{setting.code} at {address} is {read} after power-up, not {raw}")


def _factory(profile: Profile, setting: Parameter) -> None:
    order = profile.data.memory.factory
    assert order is not None
    bench = ProofBench(profile, None)
    _change(bench, setting)
    _command_memory(bench, profile[order.parameter], order.raw, bit=order.bit)
    if bench.read(setting) != setting.factory:
        raise Unproved(f"{setting.code} is {bench.read(setting)}, not {setting.factory}")


def _blocks(profile: Profile) -> Iterator[ProofStep]:
    for index, block in enumerate(profile.data.blocks):
        yield proof_step(
            ("blocks", index),
            f"block {block.id} ({block.direction}) carries its slots",
            partial(_block, profile, index),
        )


def _block(profile: Profile, index: int) -> None:
    block = profile.data.blocks[index]
    bench = ProofBench(profile, None)
    writes = block.direction == "write"
    targets = _targets(profile, index)[: len(block.slots)]
    count = max(block.min_words, min(len(targets), block.max_words))
    targets = targets[:count]
    for code, (raw, _) in zip(block.slots, targets, strict=False):
        slot = profile[code]
        if slot.access != "r":
            bench.write(slot, raw)
    if block.effective == "after-reset":
        bench.drive.power_cycle()
    address = profile[block.values[0]].address if block.values else block.address
    if writes:
        return
    words = bench.words(address, count)
    for place, (_, parameter) in enumerate(targets):
        direct = bench.words(parameter.address, 1)[0]
        if words[place] != direct:
            raise Unproved(f"slot {place + 1} carries {words[place]}, {parameter.code} is {direct}")


def _targets(profile: Profile, index: int) -> list[tuple[int, Parameter]]:
    """Return selecting raw values and parameters that a block can carry."""
    block = profile.data.blocks[index]
    writes = block.direction == "write"
    if block.selects_by == "choice":
        found = [(choice.raw, profile[choice.parameter]) for choice in block.choices]
    elif writes:
        found = [
            (profile[way.parameter].address, profile[way.parameter])
            for way in profile.data.references
        ]
    else:
        monitored = (profile[value.parameter] for value in profile.data.monitoring.values)
        found = [(p.address, p) for p in monitored if p.function == 3]
    return [(raw, p) for raw, p in found if word_count(p) == 1 and (not writes or p.access != "r")]
