#include "hal/robot/line_table.hpp"

#include <array>

namespace moldloft::hal {
namespace {

using S = LinePhase;
using E = LineCue;
using A = LineAction;
using Context = LineContext;
constexpr auto any = always<Context>;
constexpr Guard<Context> is_latched{"fault latched",
                                    [](const Context& c) MOLDLOFT_NONBLOCKING { return c.latched; }};
constexpr Guard<Context> is_stopping{"stopping",
                                     [](const Context& c) MOLDLOFT_NONBLOCKING { return c.stopping; }};
constexpr Guard<Context> has_stopped{
    "stop answered", [](const Context& c) MOLDLOFT_NONBLOCKING { return c.stopping && c.stop_known; }};
constexpr Guard<Context> has_resends{"resends left",
                                     [](const Context& c) MOLDLOFT_NONBLOCKING { return c.has_resends; }};

// clang-format off
constexpr LineTransition table[] = {
    // from        cue              guard        action                      to
    {S::offline,   E::link_open,    is_latched,  A::none,                    S::faulted},
    {S::offline,   E::link_open,    any,         A::start_sync,              S::syncing},
    {S::syncing,   E::synced,       any,         A::ask_status,              S::checking},
    {S::syncing,   E::late,         any,         A::send_syn,                S::syncing},
    {S::checking,  E::stands_still, any,         A::ask_pose,                S::locating},
    {S::checking,  E::in_motion,    any,         A::send_stop,               S::checking},
    {S::checking,  E::late,         any,         A::ask_status,              S::checking},
    {S::locating,  E::located,      any,         A::announce,                S::ready},
    {S::locating,  E::late,         any,         A::ask_pose,                S::locating},
    {S::ready,     E::command,      any,         A::send_command,            S::commanded},
    {S::commanded, E::acked,        any,         A::report_moving,           S::moving},
    {S::commanded, E::in_motion,    any,         A::report_moving,           S::moving},
    {S::commanded, E::done,         any,         A::report_done,             S::ready},
    {S::commanded, E::error,        any,         A::report_refused,          S::ready},
    {S::commanded, E::late,         is_stopping, A::ask_status,              S::commanded},
    {S::commanded, E::late,         has_resends, A::resend_command,          S::commanded},
    {S::commanded, E::late,         any,         A::ask_status,              S::commanded},
    {S::commanded, E::stands_still, has_stopped, A::report_stopped_and_sync, S::syncing},
    {S::commanded, E::stands_still, is_stopping, A::none,                    S::commanded},
    {S::commanded, E::stands_still, has_resends, A::none,                    S::commanded},
    {S::commanded, E::stands_still, any,         A::resend_afresh,           S::commanded},
    {S::moving,    E::acked,        any,         A::await_done,              S::moving},
    {S::moving,    E::done,         any,         A::report_done,             S::ready},
    {S::moving,    E::error,        any,         A::report_refused,          S::ready},
    {S::moving,    E::late,         any,         A::resend_command,          S::moving},
    {S::moving,    E::stands_still, any,         A::resend_command,          S::moving},
    {S::checking,  E::fault,        any,         A::report_fault,            S::faulted},
    {S::locating,  E::fault,        any,         A::report_fault,            S::faulted},
    {S::ready,     E::fault,        any,         A::report_fault,            S::faulted},
    {S::commanded, E::fault,        any,         A::report_fault,            S::faulted},
    {S::moving,    E::fault,        any,         A::report_fault,            S::faulted},
    {S::offline,   E::reset,        any,         A::unlatch,                 S::offline},
    {S::syncing,   E::reset,        any,         A::start_sync,              S::syncing},
    {S::checking,  E::reset,        any,         A::start_sync,              S::syncing},
    {S::locating,  E::reset,        any,         A::start_sync,              S::syncing},
    {S::ready,     E::reset,        any,         A::start_sync,              S::syncing},
    {S::commanded, E::reset,        any,         A::start_sync,              S::syncing},
    {S::moving,    E::reset,        any,         A::start_sync,              S::syncing},
    {S::faulted,   E::reset,        any,         A::start_sync,              S::syncing},
    {S::checking,  E::silent,       any,         A::report_silence,          S::syncing},
    {S::locating,  E::silent,       any,         A::report_silence,          S::syncing},
    {S::ready,     E::silent,       any,         A::report_silence,          S::syncing},
    {S::commanded, E::silent,       any,         A::report_silence,          S::syncing},
    {S::moving,    E::silent,       any,         A::report_silence,          S::syncing},
    {S::offline,   E::link_lost,    any,         A::report_loss,             S::offline},
    {S::syncing,   E::link_lost,    any,         A::report_loss,             S::offline},
    {S::checking,  E::link_lost,    any,         A::report_loss,             S::offline},
    {S::locating,  E::link_lost,    any,         A::report_loss,             S::offline},
    {S::ready,     E::link_lost,    any,         A::report_loss,             S::offline},
    {S::commanded, E::link_lost,    any,         A::report_loss,             S::offline},
    {S::moving,    E::link_lost,    any,         A::report_loss,             S::offline},
    {S::faulted,   E::link_lost,    any,         A::report_loss,             S::offline},
};

// Answers that come twice or too late; a fault while SYN is on its way, for STA asks after it.
constexpr Ignored<S, E> ignored[] = {
    {S::offline, E::silent}, {S::offline, E::synced}, {S::offline, E::in_motion},
    {S::offline, E::stands_still}, {S::offline, E::located}, {S::offline, E::command},
    {S::offline, E::acked}, {S::offline, E::done}, {S::offline, E::error}, {S::offline, E::late},
    {S::offline, E::fault},
    {S::syncing, E::link_open}, {S::syncing, E::silent}, {S::syncing, E::in_motion},
    {S::syncing, E::stands_still}, {S::syncing, E::located}, {S::syncing, E::command},
    {S::syncing, E::acked}, {S::syncing, E::done}, {S::syncing, E::error}, {S::syncing, E::fault},
    {S::checking, E::link_open}, {S::checking, E::synced}, {S::checking, E::located},
    {S::checking, E::command}, {S::checking, E::acked}, {S::checking, E::done}, {S::checking, E::error},
    {S::locating, E::link_open}, {S::locating, E::synced}, {S::locating, E::in_motion},
    {S::locating, E::stands_still}, {S::locating, E::command}, {S::locating, E::acked},
    {S::locating, E::done}, {S::locating, E::error},
    {S::ready, E::link_open}, {S::ready, E::synced}, {S::ready, E::in_motion}, {S::ready, E::stands_still},
    {S::ready, E::located}, {S::ready, E::acked}, {S::ready, E::done}, {S::ready, E::error},
    {S::ready, E::late},
    {S::commanded, E::link_open}, {S::commanded, E::synced}, {S::commanded, E::located},
    {S::commanded, E::command},
    {S::moving, E::link_open}, {S::moving, E::synced}, {S::moving, E::in_motion}, {S::moving, E::located},
    {S::moving, E::command},
    {S::faulted, E::link_open}, {S::faulted, E::silent}, {S::faulted, E::synced}, {S::faulted, E::in_motion},
    {S::faulted, E::stands_still}, {S::faulted, E::located}, {S::faulted, E::command},
    {S::faulted, E::acked}, {S::faulted, E::done}, {S::faulted, E::error}, {S::faulted, E::late},
    {S::faulted, E::fault},
};

constexpr std::array<std::string_view, line_phase_count> phase_names = {
    "offline", "syncing", "checking", "locating", "ready", "commanded", "moving", "faulted"};
constexpr std::array<std::string_view, line_cue_count> cue_names = {
    "link open", "link lost", "silent", "synced", "in motion", "stands still", "located", "command", "acked", "done",
    "error", "late", "fault", "reset"};
constexpr std::array<std::string_view, line_action_count> action_names = {
    "none", "report loss", "report silence", "start sync", "send SYN", "ask status", "send stop", "ask pose", "announce",
    "send command", "resend command", "resend afresh", "report moving", "await done", "report done", "report refused",
    "report stopped and sync", "report fault", "unlatch"};
// clang-format on

}  // namespace

std::span<const LineTransition> line_transitions() { return table; }
std::span<const Ignored<LinePhase, LineCue>> line_ignored() { return ignored; }

std::string_view to_string(LinePhase p) { return phase_names[static_cast<std::size_t>(p)]; }
std::string_view to_string(LineCue c) { return cue_names[static_cast<std::size_t>(c)]; }
std::string_view to_string(LineAction a) { return action_names[static_cast<std::size_t>(a)]; }

}  // namespace moldloft::hal
