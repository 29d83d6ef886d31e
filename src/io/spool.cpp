#include "curvesup/io/spool.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "curvesup/core/error.h"

namespace curvesup {

Spool::Spool(const std::filesystem::path& folder) : folder_(folder) {
  if (folder.empty()) return;
  std::string name = (folder / ".spool-XXXXXX").string();
  file_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (file_ < 0) fail(errno);
  ::unlink(name.c_str());
}

Spool::~Spool() {
  if (file_ >= 0) ::close(file_);
}

void Spool::append(std::string_view text) {
  size_ += text.size();
  if (folder_.empty()) {
    memory_ += text;
    return;
  }
  while (!text.empty()) {
    const ssize_t wrote = ::write(file_, text.data(), text.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) fail(errno);
    text.remove_prefix(static_cast<std::size_t>(wrote));
  }
}

void Spool::read(std::uint64_t begin, std::uint64_t end, const ByteSink& sink) const {
  if (begin > end || end > size_) throw Error(ErrorKind::internal, "spool", "has no such bytes");
  if (folder_.empty()) return sink(std::string_view(memory_).substr(begin, end - begin));
  constexpr std::uint64_t kBlock = 1 << 20;
  std::string block(std::min(kBlock, end - begin), '\0');
  while (begin < end) {
    const ssize_t got = ::pread(file_, block.data(), std::min<std::uint64_t>(block.size(), end - begin), static_cast<off_t>(begin));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail(got < 0 ? errno : EIO);
    sink(std::string_view(block).substr(0, static_cast<std::size_t>(got)));
    begin += static_cast<std::uint64_t>(got);
  }
}

void Spool::fail(int code) const {
  throw Error(ErrorKind::output, folder_.string(), std::string("a file for passing text on fails: ") + std::strerror(code),
              "check the folder's permissions and the free space");
}

}  // namespace curvesup
