#include "firmware_like/process/whole_file.hpp"

#include "hal/file_text.hpp"
#include "hal/small_disk.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using hal::text_of;
namespace fs = std::filesystem;

namespace {

std::string refused(const std::expected<void, Failure>& written) {
  return written ? "" : written.error().what;
}

mode_t mode_of(const fs::path& path) {
  struct stat what {};
  REQUIRE(::stat(path.c_str(), &what) == 0);
  return what.st_mode;
}

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator{folder}, fs::directory_iterator{}));
}

}  // namespace

TEST_CASE("a file is written whole, byte for byte, and replaces the one before") {
  const hal::TemporaryFolder folder;
  const fs::path path = folder.file("summary.json");
  const std::string bytes{"a\0b\r\n\xff", 6};
  REQUIRE(write_file(path, "first, and longer than what follows").has_value());
  REQUIRE(write_file(path, bytes).has_value());
  CHECK(text_of(path) == bytes);
  CHECK(files_in(folder.path()) == 1);  // nothing is left beside it
}

TEST_CASE("a disk that is full leaves the file of before as it was") {
  const hal::TemporaryFolder folder;
  const fs::path path = folder.file("summary.json");
  REQUIRE(write_file(path, "before").has_value());
  const auto written = [&] {
    const hal::SmallDisk disk{1000};
    return write_file(path, std::string(100'000, 'x'));
  }();
  CHECK(refused(written) ==
        path.string() + ": cannot be written: larger than this user's files may be (ulimit -f)");
  CHECK(text_of(path) == "before");
  CHECK(files_in(folder.path()) == 1);  // nor does half a file stay beside it
}

TEST_CASE("a folder that is not there is told by the file's path") {
  const hal::TemporaryFolder folder;
  CHECK(refused(write_file(folder.file("none/summary.json"), "x")) ==
        folder.file("none/summary.json") + ": cannot be written: there is no folder " + folder.file("none") +
            "; make it first");
}

TEST_CASE("a file keeps its mode when it is replaced, and a new one has the user's") {
  const hal::TemporaryFolder folder;
  const fs::path path = folder.file("plate.step");
  const mode_t mask = ::umask(027);
  REQUIRE(write_file(path, "new").has_value());
  ::umask(mask);
  CHECK((mode_of(path) & 07777) == 0640);
  fs::permissions(path, fs::perms{0604});
  REQUIRE(write_file(path, "newer").has_value());
  CHECK((mode_of(path) & 07777) == 0604);
  CHECK(text_of(path) == "newer");
}

TEST_CASE("a link stays a link, whether there is a file behind it or not yet") {
  const hal::TemporaryFolder folder;
  fs::create_directory(folder.file("behind"));
  fs::create_symlink("behind/plate.step", folder.file("first"));
  fs::create_symlink(folder.file("first"), folder.file("second"));
  for (const char* words : {"made", "replaced"}) {
    REQUIRE(write_file(folder.file("second"), words).has_value());
    CHECK(fs::is_symlink(folder.file("first")));
    CHECK(fs::is_symlink(folder.file("second")));
    CHECK(text_of(folder.file("behind/plate.step")) == words);
  }
}

TEST_CASE("a device and a pipe are written into and stay what they are") {
  const hal::TemporaryFolder folder;
  // As root, a device of our own: a writer that replaces files would take the machine's away.
  const std::string null = folder.file("null");
  if (::mknod(null.c_str(), S_IFCHR | 0666, makedev(1, 3)) == 0) {
    CHECK(refused(write_file(null, "gone")).empty());
    CHECK(S_ISCHR(mode_of(null)));
  }
  CHECK(refused(write_file("/dev/full", "x")) ==
        "/dev/full: cannot be written: the disk is full; free some space");
  const std::string pipe = folder.file("pipe");
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  CHECK(refused(write_file(pipe, "x")) == pipe + ": cannot be written: nobody reads from it");
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  REQUIRE(reader >= 0);
  CHECK(refused(write_file(pipe, "through")).empty());
  char read[16] = {};
  CHECK(::read(reader, read, sizeof read) == 7);
  CHECK(std::string{read} == "through");
  ::close(reader);
  CHECK(S_ISFIFO(mode_of(pipe)));
}

TEST_CASE("a file that is to be kept is kept, unless it says the same or nothing") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("cell.toml");
  std::ofstream{path} << "";
  CHECK(refused(write_file(path, "by us", Existing::kept)).empty());
  CHECK(refused(write_file(path, "by us", Existing::kept)).empty());
  CHECK(refused(write_file(path, "by hand", Existing::kept)) ==
        path +
            ": cannot be written: is there already and holds something else; give another name, or "
            "--force to replace it");
  CHECK(text_of(path) == "by us");
  CHECK(refused(write_file(path, "by hand", Existing::replaced)).empty());
  CHECK(text_of(path) == "by hand");
}

TEST_CASE("a folder's name and a name below a file are refused with what they are") {
  const hal::TemporaryFolder folder;
  std::ofstream{folder.file("file")} << "x";
  CHECK(refused(write_file(folder.file(""), "x")) ==
        folder.file("") + ": cannot be written: is a folder; give the name of a file");
  CHECK(refused(write_file(folder.file("file/plate"), "x")) ==
        folder.file("file/plate") + ": cannot be written: " + folder.file("file") + " is no folder");
}
