#!/usr/bin/env python3
"""What commands do whose output cannot be written, or would go where something else already is.

    unwritable.py MOLDLOFT MOLDLOFT_SIM

Each line is a command of the deployed programs, and the exit code and words that are right.
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

MOLDLOFT, SIM = sys.argv[1:3]
faults = []


def run(words, **streams):
    return subprocess.run([str(w) for w in words], text=True, timeout=120, **{"stderr": subprocess.PIPE, **streams})


def expect(what, done, code, *parts):
    said = (done.stdout or "") + (done.stderr or "")
    if done.returncode != code or not all(part in said for part in parts):
        faults.append(f"{what}: exit {done.returncode}, said {said!r}; wanted {code} and {parts}")


def expect_that(what, holds):
    if not holds:
        faults.append(what)


def unwritable_output(run_folder):
    commands = {
        "machines": [MOLDLOFT, "machines"],
        "help": [MOLDLOFT, "--help"],
        "help of run": [MOLDLOFT, "run", "--help"],
        "replay": [MOLDLOFT, "replay", run_folder],
        "report": [MOLDLOFT, "report", run_folder],
        "help of the simulation": [SIM, "--help"],
        "judge": [SIM, "judge", run_folder, "--seed", "1"],
    }
    for name, words in commands.items():
        with open("/dev/full", "w") as full:
            expect(f"{name} on a full disk", run(words, stdout=full), 1, "standard output cannot be written", "full")
        closed = run(["sh", "-c", '"$@" >&-', "sh", *words])
        expect(f"{name} on a closed output", closed, 1, "standard output cannot be written: it is closed")
        read, write = os.pipe()
        os.close(read)
        expect(f"{name} without a reader", run(words, stdout=write), 1, "its reader has gone")
        os.close(write)
        silent = run(["sh", "-c", '"$@" 2>&- >/dev/null', "sh", *words])
        expect(f"{name} without standard error", silent, 0)


def targets_of_export(folder, run_folder):
    def export(target, *more, **streams):
        return run([MOLDLOFT, "export", run_folder, "--step", target, *more], stdout=subprocess.PIPE, **streams)

    whole = (run_folder / "surface.step").read_text()
    shown = export("/dev/stdout")
    expect("export to standard output", shown, 0)
    expect_that("standard output holds the file and nothing else",
                shown.stdout.startswith("ISO-10303-21;") and shown.stdout.rstrip().endswith("END-ISO-10303-21;"))
    with open(folder / "redirected", "w+") as file:
        done = run([MOLDLOFT, "export", run_folder, "--step", "/dev/stdout"], stdout=file)
        expect("export to redirected output", done, 0)
    expect_that("the redirected file is the file", (folder / "redirected").read_text() == shown.stdout)
    expect("export to a full device", export("/dev/full"), 1, "/dev/full", "full")
    expect("export to nothing", export("/dev/null"), 0)
    expect_that("the null device is one", not os.path.isfile("/dev/null"))

    (folder / "real.step").write_text("")
    (folder / "link.step").symlink_to("real.step")
    expect("export through a link", export(folder / "link.step"), 0)
    expect_that("the link stays", (folder / "link.step").is_symlink())
    expect("export again", export(folder / "link.step"), 0)
    (folder / "mine.step").write_text("mine\n")
    expect("export over a file by hand", export(folder / "mine.step"), 1, "mine.step", "--force")
    expect_that("the file by hand is kept", (folder / "mine.step").read_text() == "mine\n")
    expect("export over it by force", export(folder / "mine.step", "--force"), 0)
    expect("export to a folder", export(folder), 1, "is a folder")
    expect("export to no folder", export(folder / "none" / "x.step"), 1, "make it first")
    expect_that("the run's own file is untouched", (run_folder / "surface.step").read_text() == whole)


def results_of_others(folder, run_folder, other_folder):
    fit = lambda out, *more: run([MOLDLOFT, "fit", run_folder, "--out", out, *more], stdout=subprocess.PIPE)
    before = (other_folder / "summary.json").read_text()
    expect("fit over another run", fit(other_folder), 1, "holds another run's results", "--force")
    expect_that("the other run is untouched", (other_folder / "summary.json").read_text() == before)
    expect("fit over the run itself", fit(run_folder), 1, "is the run itself")
    expect("fit into a new folder", fit(folder / "fit"), 0)
    expect("fit into it again", fit(folder / "fit"), 0)
    other = run([MOLDLOFT, "fit", other_folder, "--out", folder / "fit"], stdout=subprocess.PIPE)
    expect("fit of another run over that", other, 1, "holds another run's results")
    expect("fit by force", fit(other_folder, "--force"), 0)


def cells_by_hand(folder):
    cell = folder / "my.toml"
    cell.write_text("# mine\n")
    words = [SIM, "devices", "--scanner-port", "0", "--robot-pty", folder / "robot", "--cell", cell]
    expect("devices over a cell by hand", run(words, stdout=subprocess.PIPE), 1, "my.toml", "--force")
    expect_that("the cell by hand is kept", cell.read_text() == "# mine\n")
    for times in range(2):
        ended = run(["timeout", "3", *words, "--force"] if times == 0 else ["timeout", "3", *words],
                    stdout=subprocess.PIPE)
        expect("devices over their own cell", ended, 124, "ready:")


def main():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="unwritable-"))
    try:
        first, second = folder / "first", folder / "second"
        for seed, out in ((1, first), (2, second)):
            expect("a run", run([SIM, "cell", "--seed", seed, "--out", out], stdout=subprocess.DEVNULL), 0)
        if not faults:
            unwritable_output(first)
            targets_of_export(folder, first)
            results_of_others(folder, first, second)
            cells_by_hand(folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    for fault in faults:
        print("FAULT:", fault)
    print("all as it should be" if not faults else f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
