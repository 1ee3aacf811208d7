// Finds the running cell that an operator means when no socket is named: those of the service lie under /run/moldloft,
// one folder a plate.
//
// Blocking     no: a socket is tried by connecting to it, which never waits
// Allocation   yes
// Failure      one line: what was found and what to do
#pragma once

#include <expected>
#include <filesystem>
#include <string>

namespace moldloft::firmware_like {

inline constexpr const char* cells_folder = "/run/moldloft";

// Whether somebody listens to the datagram socket at `path`: 0, or the error number of trying it (ECONNREFUSED: a dead
// process has left it, or it is no socket; EACCES: we may not write to it).
int try_socket(const std::string& path);

// The socket of the only running cell: `folder`/control or one of `folder`/*/control. Sockets left by dead
// processes do not count. One that we may not write to does, since it may be the cell that was meant.
std::expected<std::string, std::string> running_cell(const std::filesystem::path& folder = cells_folder);

}  // namespace moldloft::firmware_like
