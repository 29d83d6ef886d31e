#include "curvesup/io/text_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>

#include "curvesup/core/error.h"

namespace curvesup {

namespace {
struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

std::string system_message(int code) { return code ? std::strerror(code) : "input/output error"; }
}  // namespace

std::string read_file(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw Error(ErrorKind::input, path.string(), "is a folder, not a file", "name a file");
  }
  errno = 0;
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) {
    const int code = errno;
    if (code == ENOENT) throw Error(ErrorKind::input, path.string(), "no such file", "check the path");
    throw Error(ErrorKind::input, path.string(), "cannot be opened: " + system_message(code), "check its permissions");
  }
  std::string bytes;
  const auto size = std::filesystem::file_size(path, ignored);
  if (!ignored && size > 0) bytes.reserve(size + 1);
  constexpr std::size_t kBlock = 1 << 20;
  for (std::size_t got = kBlock; got == kBlock;) {
    const std::size_t old = bytes.size();
    bytes.resize(old + kBlock);
    errno = 0;
    got = std::fread(bytes.data() + old, 1, kBlock, file.get());
    bytes.resize(old + got);
  }
  if (std::ferror(file.get())) throw Error(ErrorKind::input, path.string(), "cannot be read: " + system_message(errno));
  return bytes;
}

FileWriter::FileWriter(std::filesystem::path path) : path_(std::move(path)) {
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ < 0) {
    throw Error(ErrorKind::output, path_.string(), "cannot be written: " + system_message(errno),
                "check the folder's permissions");
  }
}

FileWriter::~FileWriter() {
  if (file_ < 0) return;
  ::close(file_);
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path_, ignored)) std::filesystem::remove(path_, ignored);
}

void FileWriter::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t wrote = ::write(file_, bytes.data(), bytes.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) fail(errno);
    bytes.remove_prefix(static_cast<std::size_t>(wrote));
  }
}

void FileWriter::finish() {
  const int file = std::exchange(file_, -1);
  if (::close(file) == 0) return;
  const int code = errno;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path_, ignored)) std::filesystem::remove(path_, ignored);
  fail(code);
}

void FileWriter::fail(int code) const {
  throw Error(ErrorKind::output, path_.string(), "cannot be written: " + system_message(code),
              "check the folder's permissions and the free space");
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  FileWriter file(path);
  file.write(bytes);
  file.finish();
}

}  // namespace curvesup
