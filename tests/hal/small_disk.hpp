// No file of this process grows beyond a size while this lives: what a full disk does, without a disk of its own.
#pragma once

#include <csignal>
#include <sys/resource.h>

namespace moldloft::hal {

class SmallDisk {
 public:
  explicit SmallDisk(rlim_t largest_file_bytes) : handler_before_{std::signal(SIGXFSZ, SIG_IGN)} {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{largest_file_bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_before_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

 private:
  void (*handler_before_)(int);
  rlimit before_{};
};

}  // namespace moldloft::hal
