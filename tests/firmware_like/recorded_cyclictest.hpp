// What `cyclictest --loops=200 --histogram=400 --json` of rt-tests 2.40 wrote on a virtual machine with other work: 199
// values in its histogram, one beyond it.
#pragma once

namespace moldloft::firmware_like {

inline constexpr const char* recorded_cyclictest =
    R"json({"file_version": 1,
"cmdline:": "cyclictest --quiet --interval=1000 --loops=200 --histogram=400 )json"
    R"json(--histfile=/dev/null --json=small.json --policy=fifo --priority=50 --mlockall",
"rt_test_version:": "2.40", "start_time": "Wed, 25 Nov 2026 19:51:01 +0000",
"end_time": "Wed, 25 Nov 2026 19:51:01 +0000", "return_code": 0, "sysinfo": {"sysname": "Linux",
"nodename": "cell", "release": "6.18.44-fc-v782", "version": "#1 SMP PREEMPT_DYNAMIC @0",
"machine": "x86_64", "realtime": 0}, "num_threads": 1, "resolution_in_ns": 0,
"thread": {"0": {"histogram": {"53": 2, "54": 7, "55": 10, "56": 13, "57": 5, "58": 12, "59": 10,
"60": 13, "61": 7, "62": 10, "63": 8, "64": 10, "65": 9, "66": 3, "67": 17, "68": 9, "69": 3,
"70": 3, "71": 5, "72": 4, "73": 3, "74": 3, "75": 2, "77": 2, "78": 1, "79": 3, "80": 2, "81": 5,
"82": 2, "83": 1, "88": 2, "92": 1, "93": 1, "98": 1, "110": 1, "117": 1, "129": 1, "133": 1,
"142": 1, "148": 1, "172": 1, "177": 1, "268": 1, "377": 1}, "cycles": 200, "min": 53, "max": 405,
"avg": 72.03, "cpu": 0, "node": 0}}})json";

}  // namespace moldloft::firmware_like
