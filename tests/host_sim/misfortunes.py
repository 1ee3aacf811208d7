#!/usr/bin/env python3
"""Starts of `moldloft run` on real links, each with one misfortune from outside at a random moment.

    misfortunes.py MOLDLOFT MOLDLOFT_SIM PTY_MODEM [--starts N] [--first I] [--side-by-side K] [--keep DIR]

Start number I is drawn from I alone. However it goes, the controller ends by itself with one of its exit codes, the arm
stands when it has ended, what was measured is saved, and the last line says how to go on. Which of these ends a start comes
to depends on the moment, so no figure of time is judged: waits have limits that only a program that hangs reaches.
"""
import argparse
import concurrent.futures
import fcntl
import json
import os
import pathlib
import pty
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import termios
import time

LONGEST_RUN_S = 150
LONGEST_END_S = 30  # after a wish to stop: results of a small plate, on a busy machine
TYPICAL_RUN_S = 9  # by the arm's motions; a misfortune after the end is none
STARVED_S = 1.0  # a third of the silence by which controller and robot give each other up
REST_SEEN_S = 1.0  # the robot's own watchdog would stop the arm only 2 s after the controller's last line or later
WORDS = {0: "complete", 2: "held", 3: "aborted", 4: "stopped"}
PLATE = ["--width", "150", "--depth", "120"]


class Start:
    """One start: its devices, its controller, and what went wrong meanwhile."""

    def __init__(self, options, number, folder):
        self.options, self.number, self.folder = options, number, folder
        self.draw = random.Random(number)
        self.out = folder / "run"
        self.environment = dict(os.environ, LD_PRELOAD=options.pty_modem)
        self.cwd = None
        self.before = None  # called in the child
        self.stdout = open(folder / "stdout", "wb")
        self.stderr = open(folder / "stderr", "wb")
        self.stdin = subprocess.DEVNULL
        self.may_wait = False  # for a person or for room: it has to be told to stop
        self.unread = False    # its words are lost, and so is the line
        self.must_be = None    # the only exit codes that are right
        self.may_lack_files = False
        self.process = None
        self.faults = []
        self.seen = {}         # by process, how long its threads have waited for a processor so far
        self.starved_s = 0.0   # the longest that one of them has waited in one piece, by the kernel's count

    def moment(self):
        return self.draw.uniform(0, TYPICAL_RUN_S)

    def words(self, out=None):
        return [self.options.moldloft, "run", str(self.folder / "cell.toml"), "--out", str(out or self.out)]

    def serve(self):
        self.log = self.folder / "devices"
        self.devices = subprocess.Popen(
            [self.options.sim, "devices", "--scanner-port", "0", "--robot-pty", str(self.folder / "robot"), "--cell",
             str(self.folder / "cell.toml"), "--seed", str(self.number % 20 + 1), "--log", *PLATE],
            stdout=open(self.log, "wb"), stderr=subprocess.STDOUT)
        self.until(lambda: "ready:" in self.log.read_text(), 30, "the devices did not come up")

    def until(self, condition, limit_s, otherwise):
        end = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > end:
                self.faults.append(otherwise)
                return False
            time.sleep(0.02)
        return True

    def begin(self, words=None, **more):
        self.process = subprocess.Popen(words or self.words(), stdin=self.stdin, stdout=self.stdout, stderr=self.stderr,
                                        env=self.environment, cwd=self.cwd, preexec_fn=self.before, **more)

    def wait_until(self, seconds):
        """True when the controller still runs then."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and self.process.poll() is None:
            self.look_at_waiting()
            time.sleep(0.02)
        return self.process.poll() is None

    def look_at_waiting(self):
        """The kernel adds a wait to a thread's count when the wait is over: what comes at once was one."""
        for process in (self.devices, self.process):
            for thread in pathlib.Path(f"/proc/{process.pid}/task").glob("*/schedstat"):
                try:
                    waited_s = int(thread.read_text().split()[1]) / 1e9
                except (OSError, IndexError, ValueError):
                    continue  # ended meanwhile
                self.starved_s = max(self.starved_s, waited_s - self.seen.get(thread, 0.0))
                self.seen[thread] = waited_s

    def send(self, number):
        if self.process.poll() is None:
            self.process.send_signal(number)

    def text(self):
        return (self.folder / "stderr").read_text(errors="replace")

    def ended(self):
        limit = 40 if self.may_wait else LONGEST_RUN_S
        if self.wait_until(limit):
            if not self.may_wait:
                self.faults.append(f"still running after {limit} s")
            self.send(signal.SIGTERM)
            if self.wait_until(LONGEST_END_S):
                self.faults.append("does not stop when it is told to")
                self.process.kill()
        return self.process.wait()

    def device_lines(self, *kinds):
        return [line for line in self.log.read_text().splitlines() if line.split(" ")[0] in kinds]

    def arm_stands(self):
        moved = self.device_lines("moves", "stands")
        return not moved or moved[-1].startswith("stands")

    def judge(self):
        code = self.ended()
        self.until(self.arm_stands, REST_SEEN_S, "the arm was left moving")
        text = self.text()
        if self.ended_before_it_began(code):
            return code
        if code < 0 or code > 4:
            self.faults.append(f"ended with {code}")
        if self.must_be is not None and code not in self.must_be and not self.machine_too_busy(code):
            self.faults.append(f"ended with {code} instead of {self.must_be}")
        if "defect" in text or "terminate" in text:
            self.faults.append("a defect shows")
        if self.device_lines("exposure") and not self.may_lack_files:
            self.judge_files(code)
        if not self.unread and code != 0:
            self.judge_line(code, text)
        return code

    def ended_before_it_began(self, code):
        """On a busy machine a signal can come while the program is still being loaded: nobody can take it then, and nothing
        is there yet that could be lost."""
        told = (-signal.SIGHUP, -signal.SIGINT, -signal.SIGTERM)
        return code in told and not self.out.exists() and not self.device_lines("moves", "stands", "exposure")

    def machine_too_busy(self, code):
        """Devices or controller did not get a processor for a second or more, or the controller missed tick after tick, by
        its own count: the run ends as it should then, but not complete."""
        if code not in (1, 3):
            return False
        words = self.text()
        try:
            words += json.loads((self.out / "summary.json").read_text())["message"]
        except (OSError, ValueError, KeyError):
            pass
        if "ticks in a row" in words:
            return True
        silence = self.unread or any(part in words for part in ("silent for", "no line came for"))
        return silence and self.starved_s >= STARVED_S

    def judge_files(self, code):
        try:
            summary = json.loads((self.out / "summary.json").read_text())
            if code in WORDS and summary["result"] != WORDS[code]:
                self.faults.append(f"exit {code}, but summary.json says {summary['result']}")
        except (OSError, ValueError, KeyError) as error:
            self.faults.append(f"no summary: {error}")

    def judge_line(self, code, text):
        last = text.rstrip("\n").split("\n")[-1].split("\x1b[K")[-1]
        if not last.startswith("moldloft"):
            self.faults.append(f"no last line: {last!r}")
        elif code in (2, 3, 4) and (self.out / "run.db").exists() and "--resume" not in last and "begin a new run" not in last:
            self.faults.append(f"no way to go on: {last!r}")

    def close(self):
        for process in (self.process, self.devices):
            if process is not None and process.poll() is None:
                process.kill()
                process.wait()
        self.stdout.close()
        self.stderr.close()


def reader_gone(s):
    """The reader of a pipe or of the journal's socket goes away."""
    import socket
    if s.draw.random() < 0.5:
        read, write = os.pipe()
        here = os.fdopen(read, "rb", buffering=0)
    else:
        here, there = socket.socketpair()
        write = there.detach()
    s.stdout = s.stderr = os.fdopen(write, "wb", buffering=0)
    s.unread, s.must_be = True, (0,)
    s.begin()
    s.stderr.close()
    s.wait_until(s.moment())
    here.close()


def nobody_reads(s):
    """A full pipe that nobody empties."""
    read, write = os.pipe()
    fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, 4096)
    s.stdout = s.stderr = os.fdopen(write, "wb", buffering=0)
    os.write(write, b"x" * s.draw.randrange(4096))
    s.unread, s.must_be = True, (0,)
    s.begin()
    s.stderr.close()
    s.kept = read  # open until the end


def log_disk_full(s):
    """The log lies on a full disk."""
    which = s.draw.choice(("out", "err", "both"))
    if which != "err":
        s.stdout = open("/dev/full", "wb", buffering=0)
    if which != "out":
        s.stderr = open("/dev/full", "wb", buffering=0)
    s.unread, s.must_be = which != "out", (0,)
    s.begin()


def descriptors_closed(s):
    """Started without some of the descriptors 0 to 2."""
    closed = s.draw.sample((0, 1, 2), s.draw.randint(1, 3))
    s.before = lambda: [os.close(d) for d in closed]
    s.unread, s.must_be = 2 in closed, (0,)
    s.begin()


def told_to_stop(s):
    """A signal that ends a run, once, or twice at once as wrappers send it."""
    s.begin()
    s.wait_until(s.moment())
    number = s.draw.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGPWR, signal.SIGXCPU))
    for _ in range(s.draw.randint(1, 3)):
        s.send(number)
        time.sleep(0.02)
    if number == signal.SIGINT:
        s.must_be = (0, 1, 4)


def wrapper(s):
    """timeout(1) ends it."""
    s.begin(["timeout", "--preserve-status", f"{max(0.3, s.moment()):.2f}", *s.words()])


def pipeline_interrupted(s):
    """2>&1 | tee log, and ctrl-C for both; or head, which ends by itself."""
    log = s.folder / "stderr"
    reader = ["tee", "/dev/null"] if s.draw.random() < 0.5 else ["head", "-n", str(s.draw.randint(1, 8))]
    end = subprocess.Popen(reader, stdin=subprocess.PIPE, stdout=open(log, "wb"))
    s.stdout = s.stderr = end.stdin
    s.unread = True
    s.begin()
    end.stdin.close()
    s.wait_until(s.moment())
    end.send_signal(signal.SIGINT)
    s.send(signal.SIGINT)
    s.must_be = (0, 1, 4)
    end.wait(10)


def meaningless_signals(s):
    """Signals that would kill or suspend a program, and mean nothing to this one."""
    s.must_be = (0,)
    s.begin()
    if not s.until(lambda: s.device_lines("moves") or s.process.poll() is not None, 60, "never moved"):
        return
    for _ in range(s.draw.randint(1, 4)):
        if s.wait_until(s.moment() / 3):
            s.send(s.draw.choice((signal.SIGUSR1, signal.SIGUSR2, signal.SIGTSTP, signal.SIGALRM, signal.SIGTTOU,
                                  signal.SIGPIPE, signal.SIGIO, signal.SIGRTMIN + 3, signal.SIGXFSZ, signal.SIGTTIN)))


def stopped_for_a_while(s):
    """SIGSTOP cannot be refused; the robot's watchdog stops the arm, and the controller finds out."""
    s.begin()
    if s.wait_until(s.moment()):
        s.send(signal.SIGSTOP)
        time.sleep(s.draw.choice((0.1, 0.5, 4)))
        s.send(signal.SIGCONT)


def second_controller(s):
    """Somebody starts another controller on the same devices, or on the same folder."""
    s.must_be = (0,)
    s.begin()
    if not s.until(lambda: s.device_lines("moves") or s.process.poll() is not None, 60, "never moved"):
        return
    s.wait_until(s.moment() / 2)
    if s.process.poll() is not None:
        return
    words = s.words() + ["--resume"] if s.draw.random() < 0.5 else s.words(s.folder / "second")
    other = subprocess.run(words, env=s.environment, capture_output=True, text=True, timeout=60)
    if s.process.poll() is None and (other.returncode != 1 or f"process {s.process.pid}" not in other.stderr):
        s.faults.append(f"the second was not refused: {other.returncode} {other.stderr!r}")
    if (s.folder / "second").exists():
        s.faults.append("the second left a folder")


def started_twice(s):
    """Two starts at the same instant with the same --out: one measures, the other is refused."""
    s.begin()
    other = subprocess.Popen(s.words(), env=s.environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if s.draw.random() < 0.5:
        s.wait_until(s.moment())
        s.send(signal.SIGINT)
    try:
        _, words = other.communicate(timeout=LONGEST_RUN_S)
    except subprocess.TimeoutExpired:
        other.kill()
        _, words = other.communicate()
        s.faults.append("the second hangs")
    codes = (s.ended(), other.returncode)
    if 1 not in codes:
        s.faults.append(f"both ran: {codes}")
    if codes[0] == 1:  # judged is the one that ran
        (s.folder / "stderr").write_text(words)
        s.process = other


def removed(s):
    """The run's folder, its store or the folder that the program was started in goes away."""
    what = s.draw.choice(("folder", "store", "cwd", "renamed"))
    s.cwd = s.folder / "here"
    s.cwd.mkdir()
    s.must_be = (0,)
    s.begin()
    if not s.until(lambda: s.device_lines("moves") or s.process.poll() is not None, 60, "never moved"):
        return
    s.wait_until(s.moment() / 2)
    if s.process.poll() is not None:
        return
    if what == "folder":
        shutil.rmtree(s.out)
    elif what == "renamed":
        s.out.rename(s.folder / "elsewhere")
    elif what == "cwd":
        s.cwd.rmdir()
    else:
        (s.out / "run.db").unlink()
    s.ended()
    if not (s.out / "run.db").exists() and s.process.returncode != 1:
        s.faults.append("the run's store is gone without a word")


def small_limits(s):
    """Few descriptors, or files that may not grow: the limits of a shell or of a service."""
    s.may_wait = True
    if s.draw.random() < 0.5:
        limit = s.draw.randint(3, 40)
        s.before = lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit))
    else:
        limit = s.draw.choice((0, 20_000, 300_000, 3_000_000, 9_000_000))
        s.before = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        s.may_lack_files = s.unread = True  # its words are a file here, too
    s.begin()


def odd_environment(s):
    """Nothing of the environment is as it should be."""
    s.environment.pop("HOME", None)
    s.environment.update(TMPDIR="/nowhere/at all", LC_ALL=s.draw.choice(("C", "tr_TR.UTF-8", "xx", "")),
                         TZ=s.draw.choice(("", "Nowhere/Odd", "UTC-14")), TERM="")
    s.cwd = s.folder
    s.must_be = (0,)
    s.begin()


def odd_folder(s):
    """The run's folder has a strange name, is a link, a file, or cannot be written."""
    kind = s.draw.choice(("name", "link", "file", "forbidden", "dangling"))
    if kind == "name":
        s.out = s.folder / "a plate's\nname; $(reboot) \\"
        s.must_be = None
    elif kind == "link":
        (s.folder / "behind").mkdir()
        s.out.symlink_to("behind")
    elif kind == "file":
        s.out.write_text("mine\n")
        s.must_be = (1,)
    elif kind == "forbidden":
        s.out = pathlib.Path("/proc/nothing/run")
        s.must_be = (1,)
    else:
        s.out.symlink_to("nowhere/at-all")
        s.must_be = (1,)
    s.begin()
    if kind in ("name", "link"):
        s.wait_until(s.moment())
        s.send(signal.SIGINT)


def terminal_gone(s):
    """Started in a terminal, which is closed."""
    master, slave = pty.openpty()

    def take_terminal():
        os.setsid()
        fcntl.ioctl(slave, termios.TIOCSCTTY, 0)

    s.before, s.stdin = take_terminal, slave
    s.stdout = s.stderr = os.fdopen(slave, "wb", buffering=0)
    s.unread = True
    s.begin()
    s.stderr.close()
    if s.draw.random() < 0.3:
        os.write(master, b"\x13")  # ctrl-S: the terminal stands still
    end, frozen = time.monotonic() + s.moment(), s.draw.random() < 0.3
    os.set_blocking(master, False)
    while time.monotonic() < end and s.process.poll() is None:
        try:
            if not frozen:
                os.read(master, 65536)
        except OSError:
            pass
        time.sleep(0.05)
    os.close(master)


def watched(s):
    """Others read the run's folder while it is written."""
    s.must_be = (0,)
    s.begin()
    if not s.until(lambda: s.device_lines("exposure") or s.process.poll() is not None, 60, "nothing was exposed"):
        return
    for n in range(3):
        s.wait_until(s.moment() / 3)
        words = [s.options.moldloft, "fit", str(s.out), "--out", str(s.folder / f"fit{n}")] if s.draw.random() < 0.5 else [
            s.options.moldloft, "replay", str(s.out)]
        seen = subprocess.run(words, capture_output=True, text=True, timeout=60)
        if seen.returncode not in (0, 1, 2, 4):
            s.faults.append(f"a reader ended with {seen.returncode}: {seen.stderr!r}")


MISFORTUNES = (reader_gone, nobody_reads, log_disk_full, descriptors_closed, told_to_stop, wrapper, pipeline_interrupted,
               meaningless_signals, stopped_for_a_while, second_controller, started_twice, removed, small_limits,
               odd_environment, odd_folder, terminal_gone, watched)


def one_start(options, number):
    folder = pathlib.Path(tempfile.mkdtemp(prefix=f"misfortune-{number}-"))
    misfortune = MISFORTUNES[number % len(MISFORTUNES)]
    s = Start(options, number, folder)
    code = None
    try:
        s.serve()
        if not s.faults:
            misfortune(s)
            code = s.judge()
    except Exception as error:  # a defect of this script is a fault, not the end of the others
        s.faults.append(f"{type(error).__name__}: {error}")
    finally:
        s.close()
    words = s.text().rstrip("\n").split("\n")[-1].split("\x1b[K")[-1]
    if s.faults and options.keep:
        shutil.copytree(folder, pathlib.Path(options.keep) / str(number), symlinks=True, dirs_exist_ok=True)
    shutil.rmtree(folder, ignore_errors=True)
    if s.starved_s >= STARVED_S:
        words = f"[waited {s.starved_s:.1f} s for a processor] {words}"
    return number, misfortune.__name__, code, words, s.faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for program in ("moldloft", "sim", "pty_modem"):  # started from other folders, too
        parser.add_argument(program, type=os.path.abspath)
    parser.add_argument("--starts", type=int, default=len(MISFORTUNES))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--side-by-side", type=int, default=2)
    parser.add_argument("--keep", help="a folder for what a failed start leaves")
    options = parser.parse_args()
    failed, codes = 0, {}
    with concurrent.futures.ThreadPoolExecutor(options.side_by_side) as pool:
        numbers = range(options.first, options.first + options.starts)
        for number, name, code, words, faults in pool.map(lambda n: one_start(options, n), numbers):
            print(f"{number:4} {name:22} exit {code}  {words[:120]}", flush=True)
            for fault in faults:
                print(f"     FAULT: {fault}", flush=True)
            failed += bool(faults)
            codes[code] = codes.get(code, 0) + 1
    print(f"{options.starts} starts, {failed} with faults; exit codes " +
          ", ".join(f"{code}: {count}" for code, count in sorted(codes.items(), key=str)))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
