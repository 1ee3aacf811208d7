#include "firmware_like/gateway/operator_channel.hpp"

#include "firmware_like/gateway/progress_text.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/json_text.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include <vector>

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

bool makes_safer(CellEvent event) { return event == CellEvent::stop || event == CellEvent::abort; }

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

// A sender that waits for its answer is connected to us, and refuses others in another way than by not being there.
bool has_gone(const sockaddr_un& sender, socklen_t size) {
  const int file = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool gone = ::connect(file, generic(sender), size) != 0 && errno == ECONNREFUSED;
  ::close(file);
  return gone;
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
  return json_text(
      Json{{"state", std::string{tasks::to_string(p.state)}},
           {"phase", std::string{tasks::to_string(p.phase)}},
           {"hold_cause", causes[static_cast<std::size_t>(p.cause)]},
           {"why", std::string{p.why.view()}},
           {"boundary_shots", p.boundary_shots},
           {"surface_shots", p.surface_shots},
           {"surface_planned", p.surface_planned},
           {"part_done", p.part_done},
           {"retaken", p.retaken},
           {"waiting", awaited_text(p, {.has_operator = true})},
           {"seconds", std::chrono::duration<double>(p.now).count()},
           {"seconds_left",
            p.time_left < 0ns ? Json(nullptr) : Json(std::chrono::duration<double>(p.time_left).count())},
           {"left_is_estimate", !p.left_is_planned}});
}

std::string answer_to(std::string_view word, tasks::CellPort& cell,
                      const std::function<void()>& let_time_pass) {
  if (word == "status") return status_json(cell.progress());
  const auto event = command_named(word);
  if (!event) return fmt::format("refused: unknown command; known: {}", operator_words());
  const tasks::CellState before = cell.progress().state;
  // What makes the cell safer is passed on in any case: the state may be another by the time that it is taken up.
  const bool changes = means_something(before, *event);
  if (changes || makes_safer(*event)) cell.command(*event);
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
    if (try_socket(path) == 0)
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
  const std::string said = without_line_end({word.data(), static_cast<std::size_t>(size)});
  const bool has_sender = from_size > sizeof from.sun_family;
  // A program that was stopped for a while must not carry out what nobody stands by any more.
  const auto event = command_named(said);
  if (has_sender && has_gone(from, from_size) && !(event && makes_safer(*event))) return;
  const std::string line = answer(said) + "\n";
  // A client that left, or does not read, gets no answer.
  if (has_sender)
    ::sendto(file_, line.data(), line.size(), MSG_DONTWAIT | MSG_NOSIGNAL, generic(from), from_size);
}

OperatorThread::OperatorThread(const OperatorSocket& socket, tasks::CellPort& cell)
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

namespace {

std::string why_not_sent(const std::string& path, int why) {
  const char* advice = why == EACCES   ? "only members of the group that owns the socket may command the cell"
                       : why == EAGAIN ? "it does not take any more words; does the program stand still?"
                       : why == ECONNREFUSED ? "nobody listens there any more"
                                             : "is moldloft running with --control?";
  return fmt::format("{}: {}; {}", path, std::strerror(why), advice);
}

// Nobody has taken it yet, but it is carried out when it is taken later.
bool waits_on(std::string_view word) {
  const auto event = command_named(word);
  return event && makes_safer(*event);
}

std::string plain_word(std::string_view word) {
  const auto first = word.find_first_not_of(" \t\r\n"), last = word.find_last_not_of(" \t\r\n");
  if (first == std::string_view::npos) return "";
  std::string plain{word.substr(first, last - first + 1)};
  std::ranges::transform(plain, plain.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; });
  return plain;
}

}  // namespace

std::string operator_words() {
  std::vector<std::string_view> words;
  for (const auto command : commands) words.push_back(tasks::to_string(command));
  return fmt::format("{}, status", fmt::join(words, ", "));
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
  if (!sent) return std::unexpected{why_not_sent(path, why)};
  if (size < 0)
    return std::unexpected{fmt::format("{}: no answer within {} s; does the program stand still? '{}' {}",
                                       path, answer_limit / 1s, word,
                                       waits_on(word) ? "still waits for it" : "is given up")};
  return hal::printable(without_line_end({answer.data(), static_cast<std::size_t>(size)}));
}

int tell_cell(const TellOptions& options) {
  const std::string word = plain_word(options.word);
  if (word != "status" && !command_named(word))
    return complain(fmt::format("'{}' is no word that a cell knows; known: {}", hal::printable(options.word),
                                operator_words()));
  const auto path = options.control.empty() ? running_cell(options.cells)
                                            : std::expected<std::string, std::string>{options.control};
  if (!path) return complain(path.error());
  const auto answer = ask_cell(word, *path);
  if (!answer || answer->starts_with("refused:")) return complain(answer ? *answer : answer.error());
  show(fmt::format("{}\n", *answer));
  return exit_done;
}

}  // namespace moldloft::firmware_like
