#include "tasks/machines/start_sequence.hpp"

#include <array>

namespace moldloft::tasks {
namespace {

using S = StartState;
using E = StartEvent;
using A = StartAction;
constexpr auto any = hal::always<StartContext>;

using Guard = hal::Guard<StartContext>;
constexpr Guard misfit{"misfit", [](const StartContext& c) MOLDLOFT_NONBLOCKING { return c.misfit; }};
constexpr Guard calibrated{"calibrated",
                           [](const StartContext& c) MOLDLOFT_NONBLOCKING { return c.calibrated; }};
constexpr Guard timed_out{"timed out",
                          [](const StartContext& c) MOLDLOFT_NONBLOCKING { return c.timed_out; }};

// clang-format off
constexpr StartTransition table[] = {
    // from           event           guard        action              to
    {S::off,          E::begin,       any,         A::connect,         S::connecting},
    {S::connecting,   E::both_ready,  misfit,      A::refuse_scanner,  S::given_up},
    {S::connecting,   E::both_ready,  calibrated,  A::go_on,           S::ready},
    {S::connecting,   E::both_ready,  any,         A::calibrate,       S::calibrating},
    {S::calibrating,  E::both_ready,  calibrated,  A::go_on,           S::ready},
    {S::calibrating,  E::both_ready,  any,         A::none,            S::calibrating},
    {S::connecting,   E::missing,     timed_out,   A::give_up,         S::given_up},
    {S::connecting,   E::missing,     any,         A::none,            S::connecting},
    {S::calibrating,  E::missing,     timed_out,   A::give_up,         S::given_up},
    {S::calibrating,  E::missing,     any,         A::none,            S::calibrating},

    // A cell that was stopped or has aborted, in whatever step, begins anew.
    {S::connecting,   E::begin,       any,         A::connect,         S::connecting},
    {S::calibrating,  E::begin,       any,         A::connect,         S::connecting},
    {S::ready,        E::begin,       any,         A::connect,         S::connecting},
    {S::given_up,     E::begin,       any,         A::connect,         S::connecting},
};

constexpr hal::Ignored<S, E> ignored[] = {
    {S::off, E::both_ready}, {S::off, E::missing}, {S::ready, E::both_ready}, {S::ready, E::missing},
    {S::given_up, E::both_ready}, {S::given_up, E::missing},
};

constexpr std::array<std::string_view, start_state_count> state_names = {
    "off", "connecting", "calibrating", "ready", "given up"};
constexpr std::array<std::string_view, start_event_count> event_names = {"begin", "both ready", "missing"};
constexpr std::array<std::string_view, 6> action_names = {
    "none", "connect", "calibrate", "go on", "refuse scanner", "give up"};
// clang-format on

}  // namespace

std::span<const StartTransition> start_transitions() { return table; }
std::span<const hal::Ignored<StartState, StartEvent>> start_ignored() { return ignored; }

std::string_view to_string(StartState s) { return state_names[static_cast<std::size_t>(s)]; }
std::string_view to_string(StartEvent e) { return event_names[static_cast<std::size_t>(e)]; }
std::string_view to_string(StartAction a) { return action_names[static_cast<std::size_t>(a)]; }

}  // namespace moldloft::tasks
