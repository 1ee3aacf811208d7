#include "hal/scanner/psc_table.hpp"

#include <array>

namespace moldloft::hal {
namespace {

using S = PscPhase;
using E = PscCue;
using A = PscAction;
using Context = PscContext;
constexpr auto any = always<Context>;
constexpr Guard<Context> has_retries{"retries left",
                                     [](const Context& c) MOLDLOFT_NONBLOCKING { return c.has_retries; }};
constexpr Guard<Context> shot_waits{
    "shot not exposed, retries left",
    [](const Context& c) MOLDLOFT_NONBLOCKING { return c.outstanding && !c.exposed && c.has_retries; }};
constexpr Guard<Context> frame_waits{"shot exposed in this session, retries left",
                                     [](const Context& c) MOLDLOFT_NONBLOCKING {
                                       return c.outstanding && c.exposed && c.has_retries && c.same_session;
                                     }};
constexpr Guard<Context> shot_is_void{"shot void",
                                      [](const Context& c) MOLDLOFT_NONBLOCKING { return c.outstanding; }};

// clang-format off
constexpr PscTransition table[] = {
    // from          cue              guard         action                    to
    {S::offline,     E::link_open,    any,          A::greet,                 S::greeting},
    {S::greeting,    E::greeted,      any,          A::configure,             S::configuring},
    {S::configuring, E::configured,   shot_waits,   A::announce_and_trigger,  S::exposing},
    {S::configuring, E::configured,   frame_waits,  A::announce_and_trigger,  S::computing},
    {S::configuring, E::configured,   shot_is_void, A::announce_and_fail,     S::ready},
    {S::configuring, E::configured,   any,          A::announce,              S::ready},
    {S::ready,       E::triggered,    any,          A::send_trigger,          S::exposing},
    {S::exposing,    E::exposed,      any,          A::report_exposed,        S::computing},
    {S::exposing,    E::frame,        any,          A::report_both,           S::ready},
    {S::exposing,    E::late,         has_retries,  A::send_trigger,          S::exposing},
    {S::exposing,    E::late,         any,          A::fail_shot,             S::ready},
    {S::exposing,    E::exposed_anew, any,          A::fail_shot,             S::ready},
    {S::exposing,    E::forgotten,    any,          A::drop_shot,             S::ready},
    {S::computing,   E::frame,        any,          A::report_frame,          S::ready},
    {S::computing,   E::late,         has_retries,  A::send_trigger,          S::computing},
    {S::computing,   E::late,         any,          A::fail_shot,             S::ready},
    {S::computing,   E::exposed_anew, any,          A::fail_shot,             S::ready},
    {S::computing,   E::forgotten,    any,          A::drop_shot,             S::ready},
    {S::offline,     E::link_lost,    any,          A::back_off,              S::offline},
    {S::greeting,    E::link_lost,    any,          A::back_off,              S::offline},
    {S::configuring, E::link_lost,    any,          A::back_off,              S::offline},
    {S::ready,       E::link_lost,    any,          A::report_loss,           S::offline},
    {S::exposing,    E::link_lost,    any,          A::report_loss,           S::offline},
    {S::computing,   E::link_lost,    any,          A::report_loss,           S::offline},
};

// Late answers to questions that nobody asks any more, and a shot that the cell forgets while no scanner has it.
constexpr Ignored<S, E> ignored[] = {
    {S::offline, E::greeted}, {S::offline, E::configured}, {S::offline, E::triggered},
    {S::offline, E::exposed}, {S::offline, E::exposed_anew}, {S::offline, E::frame}, {S::offline, E::late},
    {S::offline, E::forgotten},
    {S::greeting, E::link_open}, {S::greeting, E::configured}, {S::greeting, E::triggered},
    {S::greeting, E::exposed}, {S::greeting, E::exposed_anew}, {S::greeting, E::frame},
    {S::greeting, E::late}, {S::greeting, E::forgotten},
    {S::configuring, E::link_open}, {S::configuring, E::greeted}, {S::configuring, E::triggered},
    {S::configuring, E::exposed}, {S::configuring, E::exposed_anew}, {S::configuring, E::frame},
    {S::configuring, E::late}, {S::configuring, E::forgotten},
    {S::ready, E::link_open}, {S::ready, E::greeted}, {S::ready, E::configured}, {S::ready, E::exposed},
    {S::ready, E::exposed_anew}, {S::ready, E::frame}, {S::ready, E::late}, {S::ready, E::forgotten},
    {S::exposing, E::link_open}, {S::exposing, E::greeted}, {S::exposing, E::configured},
    {S::exposing, E::triggered},
    {S::computing, E::link_open}, {S::computing, E::greeted}, {S::computing, E::configured},
    {S::computing, E::triggered}, {S::computing, E::exposed},
};

constexpr std::array<std::string_view, psc_phase_count> phase_names = {
    "offline", "greeting", "configuring", "ready", "exposing", "computing"};
constexpr std::array<std::string_view, psc_cue_count> cue_names = {
    "link open", "link lost", "greeted", "configured", "triggered", "exposed", "exposed anew", "frame", "late", "forgotten"};
constexpr std::array<std::string_view, psc_action_count> action_names = {
    "back off", "report loss", "greet", "configure", "announce", "announce and trigger", "announce and fail",
    "send trigger", "report exposed", "report frame", "report both", "fail shot", "drop shot"};
// clang-format on

}  // namespace

std::span<const PscTransition> psc_transitions() { return table; }
std::span<const Ignored<PscPhase, PscCue>> psc_ignored() { return ignored; }

std::string_view to_string(PscPhase p) { return phase_names[static_cast<std::size_t>(p)]; }
std::string_view to_string(PscCue c) { return cue_names[static_cast<std::size_t>(c)]; }
std::string_view to_string(PscAction a) { return action_names[static_cast<std::size_t>(a)]; }

}  // namespace moldloft::hal
