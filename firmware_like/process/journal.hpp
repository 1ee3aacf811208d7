// Priorities for the system's journal. When standard error is the journal, systemd reads a line's "<4>" as
// its priority (sd-daemon(3)). Anywhere else a person would see the mark, so nothing is marked there.
//
// Allocation   yes
#pragma once

#include <string>
#include <string_view>

namespace moldloft::firmware_like {

enum class Priority { error = 3, warning = 4, notice = 5, info = 6 };

// Whether `file` is the stream that systemd has named in JOURNAL_STREAM ("device:inode").
bool is_journal(int file, const char* journal_stream);
bool stderr_is_journal();  // as the process was started

std::string for_journal(Priority, std::string_view lines);  // each line with its mark
// The same where standard error is the journal; elsewhere the lines unchanged.
std::string marked(Priority, std::string_view lines);

}  // namespace moldloft::firmware_like
