#!/usr/bin/env python3
"""The gate on the emulated cell PC: reads what two runs of run.sh left and fails unless they keep the limits.

    toolchain/cell-pc/check.py FIRST SECOND
    toolchain/cell-pc/check.py --complete ONE       only that the cell completed under PREEMPT_RT with every setting as wanted

Prints the figures of both beside their limits, then one line for each limit that is broken; the exit code is 1 when one is.
"""
import json
import pathlib
import sys

P999_TO_CYCLICTEST = 1.2  # the two wake in the same machine: ours may be later by the load of the cell, no more
MAX_TO_CYCLICTEST = 3.0
AGREEMENT = 0.05  # time counts instructions: two runs differ by when bytes cross the cable, not by the host's load
TICK_US = 1000.0


def percentile(histogram, fraction):
    """Of cyclictest's histogram {"us": count}: the smallest value that so many samples do not exceed.

    cyclictest rounds down to whole microseconds, so a limit taken from it is strict by up to one."""
    samples = sorted((int(us), count) for us, count in histogram.items())
    wanted, seen = fraction * sum(count for _, count in samples), 0
    for us, count in samples:
        seen += count
        if seen >= wanted:
            return float(us)
    raise ValueError("cyclictest took no sample")


def cyclictest_alone(folder):
    thread = json.loads((folder / "cyclictest.json").read_text())["thread"]["0"]
    return {"p50_us": percentile(thread["histogram"], 0.5), "p99_us": percentile(thread["histogram"], 0.99),
            "p999_us": percentile(thread["histogram"], 0.999), "max_us": float(thread["max"])}


def read(folder):
    folder = pathlib.Path(folder)
    run = folder / "run"
    found = {"exit": int((folder / "cell.exit").read_text()), "summary": json.loads((run / "summary.json").read_text()),
             "timing": json.loads((run / "timing.json").read_text())}
    found["waking"] = {"run": found["timing"]["wake_up"] | {"missed": found["timing"]["missed_ticks"]}}
    found["cyclictest"] = {"run": cyclictest_alone(folder)}
    if (folder / "latency.json").exists():  # the program's own comparison, made in the same machine
        latency = json.loads((folder / "latency.json").read_text())
        found["waking"]["latency"] = latency["ours"] | {"missed": latency["missed"]}
        found["cyclictest"]["latency"] = latency["cyclictest"]
    return found


def faults_of(found):
    yield from faults_of_the_cell(found)
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


def faults_of_waking(found):
    timing = found["timing"]
    for source, ours in found["waking"].items():
        other = found["cyclictest"][source]
        if ours["missed"] != 0:
            yield f"{source}: {ours['missed']} missed ticks, {timing.get('missed_by_cause')}; 0 allowed"
        for key, limit in (("p999_us", P999_TO_CYCLICTEST), ("max_us", MAX_TO_CYCLICTEST)):
            if ours[key] > limit * other[key]:
                yield f"{source}: wake-up {key} {ours[key]:.1f}, cyclictest {other[key]:.1f}: more than {limit} times as much"


def disagreements(first, second):
    for source, ours in first["waking"].items():
        theirs = second["waking"].get(source)
        if theirs is None:
            yield f"{source}: in one of the runs only"
            continue
        for key in ("p50_us", "p99_us", "p999_us"):
            low, high = sorted((ours[key], theirs[key]))
            if high > low * (1 + AGREEMENT):
                yield f"{source}: wake-up {key} {ours[key]:.2f} and {theirs[key]:.2f}: they differ by more than {AGREEMENT:.0%}"


def table(runs):
    yield f"{'wake-up, us':<24}{'p50':>8}{'p99':>8}{'p99.9':>8}{'max':>8}{'missed':>8}"
    for number, found in enumerate(runs, 1):
        for source, ours in found["waking"].items():
            for who, figures in (("ours", ours), ("cyclictest", found["cyclictest"][source])):
                cells = "".join(f"{figures[key]:>8.1f}" for key in ("p50_us", "p99_us", "p999_us", "max_us"))
                yield f"{f'{number} {source} {who}':<24}{cells}{figures.get('missed', ''):>8}"


def main(arguments):
    complete = arguments[:1] == ["--complete"]
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 1
    try:
        runs = [read(folder) for folder in (arguments[1:] if complete else arguments)]
    except (OSError, ValueError, KeyError) as missing:
        print(f"cell-pc: the results cannot be read: {missing}", file=sys.stderr)
        return 1
    print("\n".join(table(runs)))
    look = faults_of_the_cell if complete else faults_of
    faults = [f"run {number}: {fault}" for number, found in enumerate(runs, 1) for fault in look(found)]
    if not complete:
        faults += [f"the two runs: {fault}" for fault in disagreements(*runs)]
    for fault in faults:
        print(f"cell-pc: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
