#!/usr/bin/env python3
"""The package's service under systemd on the emulated cell PC: reads what one run of run.sh --jobs service left and fails
unless the package kept what it promises.

    toolchain/cell-pc/check_service.py RESULTS

Prints what was tried, then one line for each promise that is broken; the exit code is 1 when one is.
"""
import json
import pathlib
import re
import sys

PROMISED = [  # what is tried, the fact, what it must be
    ("installed: postinst", "postinst", "0"),
    ("installed: the user", "user", r"uid=\d+\(moldloft\) gid=\d+\(moldloft\) groups=\d+\(moldloft\),\d+\(dialout\)"),
    ("installed: udev gives the latency request to the group", "latency_request", "moldloft 660"),
    ("installed: udev gives the port to the group", "port", "dialout 660"),
    ("started", "start", "0"),
    ("started: it comes up held", "start_state", "Held"),
    ("started: who is not of the group is refused", "stranger", "1"),
    ("started: ... and the cell held", "stranger_state", "Held"),
    ("started: ... and nothing moves", "stranger_motions", "0"),
    ("after a crash: restarts", "crash_restarts", "1"),
    ("after a crash: held", "crash_state", "Held"),
    ("after a crash: motions before somebody says unhold", "crash_motions_while_held", "0"),
    ("after a crash: the flight recorder's last second", "crash_dump", "flight-crash.bin"),
    ("after a standstill: restarts", "standstill_restarts", "2"),
    ("after a standstill: held", "standstill_state", "Held"),
    ("after a standstill: motions before somebody says unhold", "standstill_motions_while_held", "0"),
    ("finished: the folder is the service's own", "end_folder", "moldloft 750"),
    ("held by an operator: the journal has it as a warning", "hold_journal", "1"),
    ("removed: prerm", "prerm", "0"),
    ("removed: the service", "prerm_active", "inactive"),
    ("a wrong configuration: start is refused", "wrong_start", "1"),
    ("a wrong configuration: the service", "wrong_active", "failed"),
    ("a wrong configuration: restarts", "wrong_restarts", "0"),
    ("a wrong configuration: exit code", "wrong_status", "1"),
    ("a wrong configuration: the journal has it as an error", "wrong_journal", "1"),
]

NO_CAPABILITIES = "0000000000000000"
CONFINED = {"CapEff": NO_CAPABILITIES, "CapBnd": NO_CAPABILITIES, "NoNewPrivs": "1", "Seccomp": "2"}  # 2: a filter
INTERRUPTED = 2  # times: the exposure under way may then be lost and taken again


def lines_of(path, separator):
    pairs = (line.split(separator, 1) for line in path.read_text().splitlines() if separator in line)
    return {key.strip(): value.strip() for key, value in pairs}


def json_of(path, otherwise):
    return json.loads(path.read_text()) if path.exists() else otherwise


def read(folder):
    folder = pathlib.Path(folder)
    devices = re.search(r"(\d+) exposures", (folder / "devices").read_text())
    return {"facts": lines_of(folder / "facts", "="), "process": lines_of(folder / "process", ":"),
            "threads": (folder / "threads").read_text().splitlines(), "journal": (folder / "journal").read_text(),
            "finished": json_of(folder / "plate-17/summary.json", {"result": "not there", "shots": {}}),
            "timing": json_of(folder / "plate-17/timing.json", {}),
            "removed": json_of(folder / "plate-18/summary.json", {"result": "not there", "shots": {}}),
            "exposures": int(devices.group(1)) if devices else None}


def shots_in(summary):
    return sum(summary["shots"].get(purpose, 0) for purpose in ("seek", "boundary", "surface"))


def faults_of(found):
    for what, name, promised in PROMISED:
        got = found["facts"].get(name, "not tried")
        if not re.fullmatch(promised, got):
            yield f"{what}: '{got}', promised '{promised}'"
    for name, promised in CONFINED.items():
        if found["process"].get(name) != promised:
            yield f"confined: {name} is {found['process'].get(name)}, promised {promised}"
    if set(found["process"].get("Uid", "0").split()) == {"0"}:
        yield "confined: it runs as root"
    yield from faults_of_real_time(found)
    yield from faults_of_the_plates(found)


def faults_of_real_time(found):
    control = [line for line in found["threads"] if line.startswith("control ")]
    if len(control) != 1 or "SCHED_FIFO" not in control[0]:
        yield f"real time: {len(control)} control threads, {control}; one with SCHED_FIFO promised"
    others = [line for line in found["threads"] if not line.startswith("control ") and "SCHED_OTHER" not in line]
    if others:
        yield f"real time: an ordinary thread has a class of its own: {others[0]}"
    for row in found["timing"].get("setup", []) or [{"what": "setup", "got": "nothing", "wanted": "rows", "ok": False}]:
        if not row["ok"]:
            yield f"real time: {row['what']}: {row['got']}, wanted {row['wanted']}"


def faults_of_the_plates(found):
    if "Watchdog timeout" not in found["journal"]:
        yield "after a standstill: it was not the watchdog that ended it"
    if found["finished"]["result"] != "complete":
        yield f"finished: the plate is {found['finished']['result']}, promised complete"
    if found["removed"]["result"] != "stopped":
        yield f"removed: the plate is {found['removed']['result']}, promised stopped and saved"
    saved, exposed = shots_in(found["finished"]) + shots_in(found["removed"]), found["exposures"]
    if exposed is None or not saved <= exposed <= saved + INTERRUPTED:
        yield f"finished: {exposed} exposures for {saved} shots; what is saved must not be taken again"


def main(arguments):
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 1
    try:
        found = read(arguments[0])
    except (OSError, ValueError, KeyError) as missing:
        print(f"cell-pc: the results cannot be read: {missing}", file=sys.stderr)
        return 1
    for what, name, _ in PROMISED:
        print(f"{what:<60} {found['facts'].get(name, 'not tried')}")
    faults = list(faults_of(found))
    for fault in faults:
        print(f"cell-pc: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
