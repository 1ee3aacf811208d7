// For functions that run inside a real-time loop, a piece a step: they neither allocate nor wait once their object
// is built. MOLDLOFT_GEOMETRY_NONBLOCKING says so to Clang, whose -Wfunction-effects then refuses to compile a call
// of anything that might, and whose RealtimeSanitizer stops the program where it happens all the same. Other
// compilers see nothing.
//
// MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME stands at the head of a source file whose bodies the compiler cannot see
// through, with the reason: branches of Eigen and of the standard library that allocate or throw for sizes which do
// not occur there. The sanitizer and the heap counters of the tests go on watching them.
#pragma once

#if defined(__clang__)
#if __has_cpp_attribute(clang::nonblocking)
#define MOLDLOFT_GEOMETRY_NONBLOCKING [[clang::nonblocking]]
#define MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME _Pragma("clang diagnostic ignored \"-Wfunction-effects\"")
#endif
#endif

#if !defined(MOLDLOFT_GEOMETRY_NONBLOCKING)
#define MOLDLOFT_GEOMETRY_NONBLOCKING
#define MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME
#endif
