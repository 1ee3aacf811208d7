#!/usr/bin/env python3
"""The programs, their manual pages and the completion say the same: every command and option of --help stands in the page
and every one of the page in --help; what is typed half is completed. Called with the folder of the programs and the
folder of the pages.
"""
import os
import re
import subprocess
import sys

binaries, pages = sys.argv[1:3]
widest = 100
wrong = []


def said(*words):
    """What --help prints, which must end well and fit a terminal."""
    done = subprocess.run([os.path.join(binaries, words[0]), *words[1:], "--help"], capture_output=True, text=True, timeout=60)
    if done.returncode != 0:
        wrong.append(f"{' '.join(words)} --help ends with {done.returncode}")
    for line in done.stdout.splitlines():
        if len(line) > widest:
            wrong.append(f"{' '.join(words)} --help: {len(line)} columns: {line}")
    return done.stdout


def listed(text, heading):
    """The first words of the lines under a heading of --help."""
    found, inside = set(), False
    for line in text.splitlines():
        if line and line[0] != " ":
            inside = line.startswith(heading)
        elif inside and re.match("  [^ ]", line):
            found.add(line.split()[0].replace("-h,", ""))
    return found


def described(page):
    """command -> options of a page, "" for those of the program; read from the heads of its paragraphs."""
    commands, command, section = {"": set()}, "", ""
    head = False
    for line in open(page, encoding="utf-8"):
        line = line.replace("\\-", "-").rstrip("\n")
        if line.startswith(".SH"):
            section, command = line[4:], ""
        elif line.startswith(".SS") and section == "COMMANDS":
            command = line[4:].strip('"')
            command = command if command == "The cell" else command.split()[0]
            commands[command] = set()
        elif head and section in ("COMMANDS", "OPTIONS"):
            commands[command] |= set(re.findall(r"--[a-z-]+", line))
        head = line == ".TP"
    return commands


def compare(what, in_help, in_page):
    for name in sorted(in_help - in_page):
        wrong.append(f"{what}: {name} is missing in the manual page")
    for name in sorted(in_page - in_help):
        wrong.append(f"{what}: {name} of the manual page is not in --help")


def check_page(program):
    page = described(os.path.join(pages, program + ".1"))
    of_cell = page.pop("The cell", set())
    help_text = said(program)
    commands = listed(help_text, "Subcommands")
    compare(program, commands, set(page) - {""})
    compare(program, listed(help_text, "Options"), page[""])
    for command in sorted(commands):
        options = listed(said(program, command), "Options") - {"--help"}
        with_cell = page.get(command, set()) | (of_cell if "--seed" in options else set())
        compare(f"{program} {command}", options, with_cell)
    return commands


def completed(*words):
    """What bash offers for the last word."""
    script = """
        PATH=$1:$PATH; . "$2"; shift 2
        COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
        _moldloft "$1"
        printf '%s\\n' "${COMPREPLY[@]}" """
    done = subprocess.run(["bash", "-c", script, "bash", binaries, os.path.join(pages, "moldloft.bash"), *words],
                          capture_output=True, text=True, timeout=60)
    if done.stderr:
        wrong.append(f"completion of {words}: {done.stderr}")
    return set(done.stdout.split("\n")) - {""}


def offers(words, *wanted, exactly=True):
    got = completed(*words)
    if (got != set(wanted)) if exactly else (not set(wanted) <= got):
        wrong.append(f"completion of {' '.join(words)!r}: {sorted(got)}, wanted {sorted(wanted)}")


# moldloft-cad is built where OpenCASCADE is.
for program in [name for name in ("moldloft", "moldloft-sim", "moldloft-cad") if os.path.exists(os.path.join(binaries, name))]:
    for command in check_page(program):
        offers([program, command[:-1]], command, exactly=False)
        text = said(program, command)
        offers([program, command, "--"], *listed(text, "Options"))
offers(["moldloft", "ch"], "check")
offers(["moldloft", "--v"], "--version")
offers(["moldloft", "run", "--resume-"], "--resume-held")
offers(["moldloft", "tell", "st"], "stop", "status")
offers(["moldloft-sim", "devices", "--plate", "d"], "dome")
offers(["moldloft-sim", "cell", "--plate", "=", "w"], "wave")
offers(["moldloft-sim", "cell", "--outline", "r"], "rectangle")
offers(["moldloft-sim", "cell", "--arm", ""], "scara", "gantry")
offers(["moldloft", "run", pages + "/moldloft.b"], pages + "/moldloft.bash")
offers(["moldloft-sim", "cell", "--plate", pages + "/moldloft.b"], pages + "/moldloft.bash")

for line in wrong:
    print(line, file=sys.stderr)
sys.exit(1 if wrong else 0)
