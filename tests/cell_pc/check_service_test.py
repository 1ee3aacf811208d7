"""The check on the package's service against results written by hand: kept promises pass, each broken alone is told.

    python3 check_service_test.py PATH/TO/check_service.py
"""
import copy
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

CHECK = sys.argv.pop(1)

SHOTS = {"seek": 2, "boundary": 14, "surface": 16}
GOOD = {
    "facts": {
        "postinst": "0", "user": "uid=999(moldloft) gid=999(moldloft) groups=999(moldloft),20(dialout)",
        "latency_request": "moldloft 660", "port": "dialout 660", "start": "0", "start_state": "Held", "stranger": "1",
        "stranger_state": "Held", "stranger_motions": "0", "crash_restarts": "1", "crash_state": "Held",
        "crash_motions_while_held": "0", "crash_dump": "flight-crash.bin", "standstill_restarts": "2",
        "standstill_state": "Held", "standstill_motions_while_held": "0", "end_folder": "moldloft 750", "prerm": "0",
        "prerm_active": "inactive", "wrong_start": "1", "wrong_active": "failed", "wrong_restarts": "0", "wrong_status": "1",
        "hold_journal": "1", "wrong_journal": "1",
    },
    "process": {"Uid": "999 999 999 999", "CapEff": "0" * 16, "CapBnd": "0" * 16, "NoNewPrivs": "1", "Seccomp": "2"},
    "threads": ["moldloft scheduling policy: SCHED_OTHER", "control scheduling policy: SCHED_FIFO|SCHED_RESET_ON_FORK"],
    "journal": "moldloft@plate-17.service: Watchdog timeout (limit 2s)!",
    "devices": "ready: robot\nmotion 1 at 0.5 s\nended: 38 motions, 36 exposures, 44.6 s\n",
    "plate-17/summary.json": {"result": "complete", "shots": SHOTS},
    "plate-17/timing.json": {"setup": [{"what": "scheduling", "wanted": "SCHED_FIFO 60", "got": "SCHED_FIFO 60", "ok": True}]},
    "plate-18/summary.json": {"result": "stopped", "shots": {"seek": 2, "boundary": 1, "surface": 0}},
}


def text_of(name, content):
    if name == "facts":
        return "".join(f"{key}={value}\n" for key, value in content.items())
    if name == "process":
        return "".join(f"{key}:\t{value}\n" for key, value in content.items())
    if name == "threads":
        return "\n".join(content)
    return content if isinstance(content, str) else json.dumps(content)


def check(files):
    with tempfile.TemporaryDirectory() as folder:
        for name, content in files.items():
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text_of(name, content))
        done = subprocess.run([sys.executable, CHECK, folder], capture_output=True, text=True, timeout=60)
        return done.returncode, done.stderr.splitlines()


class Service(unittest.TestCase):
    def refuses(self, change, *lines):
        changed = copy.deepcopy(GOOD)
        change(changed)
        self.assertEqual(check(changed), (1, [f"cell-pc: {line}" for line in lines]))

    def test_kept_promises_pass(self):
        self.assertEqual(check(GOOD), (0, []))

    def test_each_fact_broken_or_missing_is_told(self):
        for name, good in GOOD["facts"].items():
            with self.subTest(name):
                changed = copy.deepcopy(GOOD)
                changed["facts"][name] = good + "7"
                code, told = check(changed)
                self.assertEqual((code, len(told)), (1, 1))
                self.assertIn(f"'{good}7'", told[0])
                del changed["facts"][name]
                self.assertIn("'not tried'", check(changed)[1][0])

    def test_a_process_that_may_too_much(self):
        for name in ("CapEff", "CapBnd", "NoNewPrivs", "Seccomp"):
            def free(files): files["process"][name] = "0"
            if name.startswith("Cap"):
                def free(files): files["process"][name] = "0000000000800000"
            changed = copy.deepcopy(GOOD)
            free(changed)
            code, told = check(changed)
            self.assertEqual((code, len(told)), (1, 1))
            self.assertTrue(told[0].startswith(f"cell-pc: confined: {name} is "), told)
        def root(files): files["process"]["Uid"] = "0 0 0 0"
        self.refuses(root, "confined: it runs as root")

    def test_threads_of_another_class(self):
        def ordinary(files): files["threads"][1] = "control scheduling policy: SCHED_OTHER"
        self.refuses(ordinary, "real time: 1 control threads, ['control scheduling policy: SCHED_OTHER']; "
                               "one with SCHED_FIFO promised")
        def eager(files): files["threads"][0] = "moldloft scheduling policy: SCHED_FIFO"
        self.refuses(eager, "real time: an ordinary thread has a class of its own: moldloft scheduling policy: SCHED_FIFO")

    def test_settings_that_were_not_had(self):
        def refused(files): files["plate-17/timing.json"]["setup"][0] |= {"got": "SCHED_OTHER", "ok": False}
        self.refuses(refused, "real time: scheduling: SCHED_OTHER, wanted SCHED_FIFO 60")
        def unread(files): files["plate-17/timing.json"]["setup"] = []
        self.refuses(unread, "real time: setup: nothing, wanted rows")

    def test_plates(self):
        def held(files): files["plate-17/summary.json"]["result"] = "held"
        self.refuses(held, "finished: the plate is held, promised complete")
        def aborted(files): files["plate-18/summary.json"]["result"] = "aborted"
        self.refuses(aborted, "removed: the plate is aborted, promised stopped and saved")
        def twice(files): files["devices"] = "ended: 60 motions, 40 exposures, 44 s"
        def unfinished(files): del files["plate-18/summary.json"]
        self.refuses(unfinished, "removed: the plate is not there, promised stopped and saved",
                     "finished: 36 exposures for 32 shots; what is saved must not be taken again")
        self.refuses(twice, "finished: 40 exposures for 35 shots; what is saved must not be taken again")
        def another_way(files): files["journal"] = "killed"
        self.refuses(another_way, "after a standstill: it was not the watchdog that ended it")

    def test_results_that_are_not_there(self):
        files = copy.deepcopy(GOOD)
        del files["journal"]
        code, told = check(files)
        self.assertEqual((code, len(told)), (1, 1))
        self.assertTrue(told[0].startswith("cell-pc: the results cannot be read: "), told)


unittest.main()
