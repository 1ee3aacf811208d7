#!/usr/bin/env python3
"""The gate on the emulated cell PC: reads what two runs of run.sh left and fails unless they keep the limits.

    toolchain/cell-pc/check.py FIRST SECOND

Prints the figures of both beside their limits, then one line for each limit that is broken; the exit code is 1 when one is.
"""
import json
import pathlib
import sys

P999_TO_CYCLICTEST = 1.2  # the two wake in the same machine: ours may be later by the load of the cell, no more
MAX_TO_CYCLICTEST = 3.0
TICK_US = 1000.0

# Where cyclictest takes turns with ours and nothing else runs, before the cable is used. The whole cell shares its
# processor with the simulated devices, whose bytes cross the cable when the emulator looks: it is held to no missed tick
# and to the maximum.
SELF_TEST = "latency"

# The row of the task table that makes no system call: what it takes is all ours, as the background's steps are. In the
# drivers' rows the kernel also does the work of the link's far end, which is in the same machine here.
COMPUTES = "cell"


def percentile(histogram, fraction):
    """Of cyclictest's histogram {"us": count}: the smallest value that so many samples do not exceed.

    cyclictest rounds down to whole microseconds: n counts as n + 0.5, as in moldloft latency."""
    samples = sorted((int(us), count) for us, count in histogram.items())
    wanted, seen = fraction * sum(count for _, count in samples), 0
    for us, count in samples:
        seen += count
        if seen >= wanted:
            return us + 0.5
    raise ValueError("cyclictest took no sample")


def cyclictest_alone(folder):
    thread = json.loads((folder / "cyclictest.json").read_text())["thread"]["0"]
    return {"p50_us": percentile(thread["histogram"], 0.5), "p99_us": percentile(thread["histogram"], 0.99),
            "p999_us": percentile(thread["histogram"], 0.999), "max_us": thread["max"] + 0.5}


def read(folder):
    folder = pathlib.Path(folder)
    run = folder / "run"
    found = {"exit": int((folder / "cell.exit").read_text()), "summary": json.loads((run / "summary.json").read_text()),
             "timing": json.loads((run / "timing.json").read_text())}
    found["waking"] = {"run": found["timing"]["wake_up"] | {"missed": found["timing"]["missed_ticks"]}}
    found["cyclictest"] = {"run": cyclictest_alone(folder)}
    latency = json.loads((folder / "latency.json").read_text())  # the program's own comparison, in the same machine
    found["waking"]["latency"] = latency["ours"] | {"missed": latency["missed"]}
    found["cyclictest"]["latency"] = latency["cyclictest"]
    return found


def faults_of(found):
    yield from faults_of_the_cell(found)
    yield from faults_of_the_budget(found)
    yield from faults_of_waking(found)


def faults_of_the_cell(found):
    timing, summary = found["timing"], found["summary"]
    if found["exit"] != 0 or summary["result"] != "complete":
        yield f"the cell ended with {found['exit']}, {summary['result']}: {summary.get('message', '')}"
    if timing["tick_us"] != TICK_US:
        yield f"a tick of {timing['tick_us']} us; the limits are for {TICK_US:.0f}"
    if timing.get("environment", {}).get("sysinfo", {}).get("realtime") != 1:
        yield "PREEMPT_RT was not recognised"
    if not timing.get("setup"):
        yield "no setting was read back"
    for row in timing.get("setup", []):
        if not row["ok"]:
            yield f"{row['what']}: {row['got']}, wanted {row['wanted']}"


def faults_of_the_budget(found):
    for row in found["timing"]["tasks"]:
        if row["name"] == COMPUTES and row["overruns"] != 0:
            yield f"{COMPUTES}: {row['overruns']} runs over its budget of {row['budget_us']:.0f} us, the longest {row['cost']['max_us']:.0f}"
    for row in found["timing"]["background"]:
        if row["overruns"] != 0:
            yield f"{row['name']}: {row['overruns']} steps over its quantum of {row['quantum_us']:.0f} us, the longest {row['cost']['max_us']:.0f}"


def faults_of_waking(found):
    timing = found["timing"]
    for source, ours in found["waking"].items():
        other = found["cyclictest"][source]
        if ours["missed"] != 0:
            yield f"{source}: {ours['missed']} missed ticks, {timing.get('missed_by_cause')}; 0 allowed"
        limits = [("max_us", MAX_TO_CYCLICTEST)]
        if source == SELF_TEST:
            limits.insert(0, ("p999_us", P999_TO_CYCLICTEST))
        for key, limit in limits:
            if ours[key] > limit * other[key]:
                yield f"{source}: wake-up {key} {ours[key]:.1f}, cyclictest {other[key]:.1f}: more than {limit} times as much"


def disagreements(first, second):
    """Up to the whole cell nothing from outside reaches the machine: the two runs are one run, to the nanosecond.

    One whose self-test differs is told although each keeps the limits: a figure that does not come back is no gate."""
    for who, name in (("waking", "ours"), ("cyclictest", "cyclictest")):
        one, other = first[who][SELF_TEST], second[who][SELF_TEST]
        for key in sorted(one.keys() | other.keys()):
            if one.get(key) != other.get(key):
                yield f"{SELF_TEST}, {name}: {key} {one.get(key)} and {other.get(key)}: the machine is not reproducible"


def table(runs):
    yield f"{'wake-up, us':<24}{'p50':>8}{'p99':>8}{'p99.9':>8}{'max':>8}{'missed':>8}"
    for number, found in enumerate(runs, 1):
        for source, ours in found["waking"].items():
            for who, figures in (("ours", ours), ("cyclictest", found["cyclictest"][source])):
                cells = "".join(f"{figures[key]:>8.1f}" for key in ("p50_us", "p99_us", "p999_us", "max_us"))
                yield f"{f'{number} {source} {who}':<24}{cells}{figures.get('missed', ''):>8}"


def main(arguments):
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 1
    try:
        runs = [read(folder) for folder in arguments]
    except (OSError, ValueError, KeyError) as missing:
        print(f"cell-pc: the results cannot be read: {missing}", file=sys.stderr)
        return 1
    print("\n".join(table(runs)))
    faults = [f"run {number}: {fault}" for number, found in enumerate(runs, 1) for fault in faults_of(found)]
    faults += [f"the two runs: {fault}" for fault in disagreements(*runs)]
    for fault in faults:
        print(f"cell-pc: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
