#!/usr/bin/env python3
"""toolchain/TROUBLESHOOTING.md against the source: every message of its tables really exists, and every message with which
the machines and drivers hold or abort a run stands there. Called with the source tree.
"""
import pathlib
import re
import sys

tree = pathlib.Path(sys.argv[1])
# Where a hold, an abort or a lost device gets its words.
speakers = ["tasks/machines/boundary_tracker.cpp", "tasks/cell/cell.cpp", "tasks/cell/device_words.cpp", "tasks/cell/disk_wait.cpp", "tasks/cell/measurement.cpp",
            "tasks/cell/shot_taker.cpp", "tasks/cell/supervisor.cpp", "tasks/cell/motion_guard.cpp", "firmware_like/results/audit.cpp", "tasks/planning/flaw_words.cpp", "tasks/planning/outline_words.cpp", "tasks/slices/surface_task.cpp", "tasks/slices/frame_health.cpp", "firmware_like/controller/controller.cpp", "hal/robot/line_robot.cpp",
            "hal/scanner/psc_scanner.cpp", "hal/record/recorder.cpp", "hal/links/serial_link.cpp", "hal/links/tcp_link.cpp"]


def plain(text):
    """A pattern as a person meets it: what is filled in is '...'."""
    return re.sub(r"\{[^}]*\}", "...", text.replace('\\"', '"'))


def literals(path):
    """The string literals of a source, adjacent ones joined, comments left out."""
    text = re.sub(r'("(?:\\.|[^"\\\n])*")|//[^\n]*|/\*.*?\*/', lambda m: m.group(1) or "", path.read_text(encoding="utf-8"), flags=re.S)
    for run in re.findall(r'"(?:\\.|[^"\\\n])*"(?:\s*"(?:\\.|[^"\\\n])*")*', text):
        yield plain("".join(re.findall(r'"((?:\\.|[^"\\\n])*)"', run)))


def is_sentence(text):
    words = text.replace("...", " ").split()
    return len(words) >= 4 and not text.endswith((".hpp", ".h"))


rows = set(re.findall(r"^\| `([^`]+)` \|", (tree / "toolchain/TROUBLESHOOTING.md").read_text(encoding="utf-8"), flags=re.M))
everywhere = {text for room in ("geometry", "hal", "tasks", "firmware_like", "host_sim")
              for path in (tree / room).rglob("*.cpp") for text in literals(path)}
spoken = {text for name in speakers for text in literals(tree / name) if is_sentence(text)}
wrong = [f"TROUBLESHOOTING.md: no source says: {row}" for row in sorted(rows) if not any(row in text for text in everywhere)]
wrong += [f"TROUBLESHOOTING.md lacks: {text}" for text in sorted(spoken) if not any(row in text for row in rows)]
if len(rows) < 40 or len(spoken) < 30:
    wrong.append(f"only {len(rows)} rows and {len(spoken)} messages were found: the test reads nothing")
for line in wrong:
    print(line, file=sys.stderr)
sys.exit(1 if wrong else 0)
