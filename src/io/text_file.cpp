#include "curvesup/io/text_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

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

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  const auto fail = [&](int code) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);
    throw Error(ErrorKind::output, path.string(), "cannot be written: " + system_message(code),
                "check the folder's permissions and the free space");
  };
  errno = 0;
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) {
    throw Error(ErrorKind::output, path.string(), "cannot be written: " + system_message(errno),
                "check the folder's permissions");
  }
  const bool wrote = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  const int write_code = errno;
  if (!wrote) {
    std::fclose(file);
    fail(write_code);
  }
  if (std::fclose(file) != 0) fail(errno);
}

}  // namespace curvesup
