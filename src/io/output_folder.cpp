#include "curvesup/io/output_folder.h"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>

#include "curvesup/core/error.h"
#include "curvesup/core/parallel.h"
#include "curvesup/io/sha256.h"
#include "curvesup/io/text_file.h"

namespace curvesup {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const fs::path& where, const std::string& what, const std::string& remedy = {}) {
  throw Error(ErrorKind::output, where.string(), what, remedy);
}

void check(const std::error_code& code, const fs::path& where, const char* what) {
  if (code) fail(where, std::string(what) + ": " + code.message(), "check the folder's permissions and the free space");
}

// The folder itself behind symbolic links, "." and a trailing slash.
fs::path resolved(const fs::path& path) {
  if (path.empty()) fail("output folder", "its name is empty", "name a folder");
  std::error_code code;
  fs::path result = fs::weakly_canonical(fs::absolute(path, code), code);
  check(code, path, "is no possible path");
  if (!result.has_filename()) result = result.parent_path();
  if (!result.has_filename()) fail(path, "is no possible output folder", "name a folder below it");
  return result;
}

void refuse_foreign(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) {
    if (code && code.value() != ENOENT && code.value() != ENOTDIR) check(code, path, "cannot be looked at");
    return;
  }
  if (!fs::is_directory(status)) fail(path, "exists and is not a folder", "name another output folder");
  const bool empty = fs::is_empty(path, code);
  check(code, path, "cannot be looked at");
  if (empty) return;
  for (const char* sign : {"manifest.json", "report.json"}) {
    if (!fs::is_regular_file(path / sign, code)) {
      fail(path, std::string("is a folder with other files in it (no ") + sign + "); it will not be replaced",
           "name another output folder or empty this one");
    }
  }
}

// ".NAME.part-PID-N" and ".NAME.old-PID-N" are ours to remove when process PID is gone.
void remove_leftovers(const fs::path& final_path) {
  std::error_code code;
  for (const std::string kind : {".part-", ".old-"}) {
    const std::string prefix = "." + final_path.filename().string() + kind;
    for (const fs::directory_entry& entry : fs::directory_iterator(final_path.parent_path(), code)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(prefix) || !entry.is_directory(code)) continue;
      long pid = 0;
      const char* end = name.data() + name.size();
      const auto result = std::from_chars(name.data() + prefix.size(), end, pid);
      if (result.ec != std::errc() || result.ptr == end || *result.ptr != '-' || pid <= 0) continue;
      const bool alive = ::kill(static_cast<pid_t>(pid), 0) == 0 || errno != ESRCH;
      // An old output whose successor never came is the only copy: it goes back, not away.
      if (!alive && kind == ".old-" && !fs::exists(final_path, code))
        fs::rename(entry.path(), final_path, code);
      else if (!alive)
        fs::remove_all(entry.path(), code);
    }
  }
}

fs::path sibling(const fs::path& final_path, const char* kind, int number) {
  return final_path.parent_path() /
         ("." + final_path.filename().string() + kind + std::to_string(::getpid()) + "-" + std::to_string(number));
}

}  // namespace

OutputFolder::OutputFolder(const fs::path& final_path) : final_(resolved(final_path)) {
  refuse_foreign(final_);
  try {
    make_parents();
    remove_leftovers(final_);
    make_working_folder();
  } catch (...) {
    clean_up();
    throw;
  }
}

OutputFolder::~OutputFolder() {
  if (!committed_) clean_up();
}

void OutputFolder::make_parents() {
  std::vector<fs::path> missing;
  std::error_code code;
  for (fs::path p = final_.parent_path(); !fs::exists(p, code) && p.has_relative_path(); p = p.parent_path()) {
    missing.push_back(p);
  }
  for (auto p = missing.rbegin(); p != missing.rend(); ++p) {
    const bool made = fs::create_directory(*p, code);
    check(code, *p, "cannot be made");
    if (made) made_parents_.push_back(*p);
  }
}

void OutputFolder::make_working_folder() {
  std::error_code code;
  for (int number = 0;; ++number) {
    const fs::path candidate = sibling(final_, ".part-", number);
    const bool made = fs::create_directory(candidate, code);
    check(code, final_, "cannot be written");
    if (made) {
      working_ = candidate;
      return;
    }
  }
}

void OutputFolder::clean_up() noexcept {
  std::error_code ignored;
  if (!working_.empty()) fs::remove_all(working_, ignored);
  for (auto p = made_parents_.rbegin(); p != made_parents_.rend(); ++p) fs::remove(*p, ignored);
}

OutputFolder::File OutputFolder::write_one(std::string_view relative,
                                           const std::function<void(const ByteSink&)>& produce) const {
  const fs::path path = fs::path(relative).lexically_normal();
  if (committed_ || path.empty() || path.is_absolute() || *path.begin() == ".." || !path.has_filename()) {
    throw Error(ErrorKind::internal, "output folder", "cannot write '" + std::string(relative) + "' into it");
  }
  const fs::path target = working_ / path;
  std::error_code code;
  fs::create_directories(target.parent_path(), code);
  check(code, final_ / path, "cannot be written");
  File file{path.generic_string(), 0, {}};
  Sha256 hash;
  try {
    FileWriter writer(target);
    produce([&](std::string_view bytes) {
      writer.write(bytes);
      hash.add(bytes);
      file.bytes += bytes.size();
    });
    writer.finish();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::output) throw;
    throw Error(error.kind(), (final_ / path).string(), error.problem(), error.remedy());
  }
  file.sha256 = hash.hex();
  return file;
}

void OutputFolder::write(std::string_view relative, const std::function<void(const ByteSink&)>& produce) {
  files_.push_back(write_one(relative, produce));
}

void OutputFolder::write(std::string_view relative, std::string_view bytes) {
  write(relative, [bytes](const ByteSink& sink) { sink(bytes); });
}

void OutputFolder::write_all(std::span<const Task> tasks, const RunContext& run) {
  std::vector<File> written(tasks.size());
  parallel_for(tasks.size(), 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) written[i] = write_one(tasks[i].relative, tasks[i].produce);
  });
  files_.insert(files_.end(), written.begin(), written.end());
}

void OutputFolder::commit() {
  if (committed_) throw Error(ErrorKind::internal, "output folder", "is committed twice");
  refuse_foreign(final_);
  std::error_code code;
  fs::path old;
  if (fs::exists(final_, code)) {
    for (int number = 0; old.empty() || fs::exists(old, code); ++number) old = sibling(final_, ".old-", number);
    fs::rename(final_, old, code);
    check(code, final_, "the older output cannot be replaced");
  }
  fs::rename(working_, final_, code);
  if (code) {
    std::error_code ignored;
    if (!old.empty()) fs::rename(old, final_, ignored);
    check(code, final_, "cannot be moved into place");
  }
  committed_ = true;
  if (!old.empty()) fs::remove_all(old, code);
}

}  // namespace curvesup
