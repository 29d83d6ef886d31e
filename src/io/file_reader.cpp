#include "curvesup/io/file_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "curvesup/core/error.h"

namespace curvesup {

FileReader::FileReader(const std::filesystem::path& path) : path_(path.string()) {
  file_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (file_ < 0) {
    const int code = errno;
    if (code == ENOENT) throw Error(ErrorKind::input, path_, "no such file", "check the path");
    throw Error(ErrorKind::input, path_, std::string("cannot be opened: ") + std::strerror(code), "check its permissions");
  }
  struct stat status {};
  if (::fstat(file_, &status) != 0 || S_ISDIR(status.st_mode)) {
    ::close(file_);
    throw Error(ErrorKind::input, path_, "is a folder, not a file", "name a file");
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

FileReader::~FileReader() { ::close(file_); }

std::size_t FileReader::read(std::uint64_t at, char* to, std::size_t count) const {
  std::size_t done = 0;
  while (done < count) {
    const ssize_t got = ::pread(file_, to + done, count - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw Error(ErrorKind::input, path_, std::string("cannot be read: ") + std::strerror(errno));
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

}  // namespace curvesup
