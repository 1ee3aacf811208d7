#include "firmware_like/operator_channel.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <vector>

#include "firmware_like/console.hpp"
#include "firmware_like/run_command.hpp"
#include "hal/printable_text.hpp"

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;
using tasks::CellEvent;

constexpr auto commands =
    std::to_array<CellEvent>({CellEvent::start, CellEvent::hold, CellEvent::unhold, CellEvent::stop,
                              CellEvent::abort, CellEvent::clear, CellEvent::reset});
constexpr std::size_t longest_line = 1024;

// A command is taken up in the next tick; a loop that has not done so after this many looks does not run.
constexpr int most_looks = 50;
constexpr hal::Duration look_period = 10ms;
constexpr hal::Duration answer_limit = 2s;
static_assert(2 * most_looks * look_period <= answer_limit);

constexpr hal::Duration serve_period = 100ms;  // how long the end of the program waits for the thread

std::optional<CellEvent> command_named(std::string_view word) {
  for (const auto event : commands) {
    if (tasks::to_string(event) == word) return event;
  }
  return std::nullopt;
}

bool means_something(tasks::CellState state, CellEvent event) {
  return find_transition(tasks::cell_transitions(), state, event, tasks::CellContext{}) != nullptr;
}

std::optional<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return std::nullopt;
  path.copy(address.sun_path, path.size());
  return address;
}

const sockaddr* generic(const sockaddr_un& address) { return reinterpret_cast<const sockaddr*>(&address); }

bool is_listened_to(const sockaddr_un& address) {
  const int file = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool connected = ::connect(file, generic(address), sizeof address) == 0;
  ::close(file);
  return connected;
}

bool waits_no_longer_than(hal::Duration limit, int file) {
  pollfd look{.fd = file, .events = POLLIN, .revents = 0};
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(limit);
  return ::poll(&look, 1, static_cast<int>(ms.count())) > 0;
}

std::string without_line_end(std::string_view text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\0')) text.remove_suffix(1);
  return std::string{text};
}

}  // namespace

std::string status_json(const tasks::CellProgress& p) {
  constexpr std::array<const char*, 6> causes = {"none",   "scanner", "recorder",
                                                 "person", "plan",    "measurement"};
  return json_text(Json{{"state", std::string{tasks::to_string(p.state)}},
                        {"phase", std::string{tasks::to_string(p.phase)}},
                        {"hold_cause", causes[static_cast<std::size_t>(p.cause)]},
                        {"why", std::string{p.why.view()}},
                        {"boundary_shots", p.boundary_shots},
                        {"surface_shots", p.surface_shots},
                        {"surface_planned", p.surface_planned},
                        {"retaken", p.retaken},
                        {"seconds", std::chrono::duration<double>(p.now).count()}});
}

std::string answer_to(std::string_view word, tasks::Cell& cell, const std::function<void()>& let_time_pass) {
  if (word == "status") return status_json(cell.progress());
  const auto event = command_named(word);
  if (!event) {
    std::vector<std::string_view> known;
    for (const auto command : commands) known.push_back(tasks::to_string(command));
    return fmt::format("refused: unknown command; known: {}, status", fmt::join(known, ", "));
  }
  const tasks::CellState before = cell.progress().state;
  // What makes the cell safer is passed on in any case: the state may be another by the time that it is taken up.
  const bool is_safe = *event == CellEvent::stop || *event == CellEvent::abort;
  const bool changes = means_something(before, *event);
  if (changes || is_safe) cell.command(*event);
  if (!changes) return fmt::format("refused: {} means nothing in {}", word, tasks::to_string(before));
  for (int look = 0; look < most_looks; ++look) {
    let_time_pass();
    if (const auto now = cell.progress().state; now != before)
      return fmt::format("done: {} -> {}", tasks::to_string(before), tasks::to_string(now));
  }
  return fmt::format("refused: {} was sent in {}, but the control loop does not answer", word,
                     tasks::to_string(before));
}

std::expected<OperatorSocket, std::string> OperatorSocket::open(const std::string& path) {
  const auto address = address_of(path);
  if (!address)
    return std::unexpected{fmt::format("--control {}: a path of 1 to 107 characters is wanted", path)};
  struct stat there {};
  if (::stat(path.c_str(), &there) == 0) {
    if (!S_ISSOCK(there.st_mode))
      return std::unexpected{fmt::format("--control {}: is there and no socket", path)};
    if (is_listened_to(*address))
      return std::unexpected{fmt::format("--control {}: another moldloft listens there", path)};
    ::unlink(path.c_str());
  }
  const int file = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (file < 0 || ::bind(file, generic(*address), sizeof *address) != 0) {
    const int why = errno;
    if (file >= 0) ::close(file);
    return std::unexpected{fmt::format("--control {}: {}", path, std::strerror(why))};
  }
  ::chmod(path.c_str(), 0660);
  return OperatorSocket{file, path};
}

OperatorSocket::OperatorSocket(OperatorSocket&& other) noexcept
    : file_{std::exchange(other.file_, -1)}, path_{std::move(other.path_)} {}

OperatorSocket::~OperatorSocket() {
  if (file_ < 0) return;
  ::close(file_);
  ::unlink(path_.c_str());
}

void OperatorSocket::serve(hal::Duration wait,
                           const std::function<std::string(std::string_view)>& answer) const {
  if (!waits_no_longer_than(wait, file_)) return;
  std::array<char, longest_line> word;
  sockaddr_un from{};
  socklen_t from_size = sizeof from;
  const ssize_t size = ::recvfrom(file_, word.data(), word.size(), MSG_DONTWAIT,
                                  reinterpret_cast<sockaddr*>(&from), &from_size);
  if (size < 0) return;
  const std::string line = answer(without_line_end({word.data(), static_cast<std::size_t>(size)})) + "\n";
  // Who has gone away, or does not read, has no answer.
  if (from_size > sizeof from.sun_family)
    ::sendto(file_, line.data(), line.size(), MSG_DONTWAIT | MSG_NOSIGNAL, generic(from), from_size);
}

OperatorThread::OperatorThread(const OperatorSocket& socket, tasks::Cell& cell)
    : socket_{socket}, cell_{cell}, thread_{[this] { work(); }} {}

OperatorThread::~OperatorThread() {
  ending_ = true;
  thread_.join();
}

void OperatorThread::work() {
  const auto let_time_pass = [this] { clock_.sleep_until(clock_.now() + look_period); };
  while (!ending_) {
    socket_.serve(serve_period, [&](std::string_view word) { return answer_to(word, cell_, let_time_pass); });
  }
}

std::expected<std::string, std::string> ask_cell(const std::string& word, const std::string& path) {
  const auto address = address_of(path);
  if (!address)
    return std::unexpected{fmt::format("--control {}: a path of 1 to 107 characters is wanted", path)};
  const int file = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  // Bound to no name of ours: the kernel finds one, which needs no file and goes with the socket.
  const sockaddr_un nameless{.sun_family = AF_UNIX, .sun_path = {}};
  const bool sent = ::bind(file, generic(nameless), sizeof nameless.sun_family) == 0 &&
                    ::connect(file, generic(*address), sizeof *address) == 0 &&
                    ::send(file, word.data(), word.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0;
  const int why = errno;
  std::array<char, longest_line> answer;
  const ssize_t size = sent && waits_no_longer_than(answer_limit, file)
                           ? ::recv(file, answer.data(), answer.size(), MSG_DONTWAIT)
                           : -1;
  ::close(file);
  if (!sent)
    return std::unexpected{
        fmt::format("{}: {}; is moldloft running with --control?", path, std::strerror(why))};
  if (size < 0) return std::unexpected{fmt::format("{}: no answer within {} s", path, answer_limit / 1s)};
  return hal::printable(without_line_end({answer.data(), static_cast<std::size_t>(size)}));
}

int tell_cell(const TellOptions& options) {
  const auto answer = ask_cell(options.word, options.control);
  if (!answer || answer->starts_with("refused:")) {
    return complain(answer ? *answer : answer.error());
  }
  show(fmt::format("{}\n", *answer));
  return exit_done;
}

}  // namespace moldloft::firmware_like
