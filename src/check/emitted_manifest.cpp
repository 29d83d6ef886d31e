#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "check/emitted_sync.h"
#include "curvesup/core/error.h"
#include "curvesup/io/sha256.h"
#include "curvesup/io/text_file.h"

namespace curvesup::emitted {

namespace {

using Json = nlohmann::json;

Json read_json(const std::filesystem::path& file) {
  Json json = Json::parse(read_file(file), nullptr, false);
  if (json.is_discarded() || !json.is_object()) throw Error(ErrorKind::input, file.string(), "is no JSON object", "slice again");
  return json;
}

bool good_name(const std::string& name) {
  if (name.empty() || name.size() > 100) return false;
  for (const char c : name) {
    const bool good = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '.' || c == '-';
    if (!good) return false;
  }
  return true;
}

class ManifestCheck {
 public:
  ManifestCheck(const Programs& programs, const std::filesystem::path& folder, Findings& findings)
      : programs_(programs), folder_(folder), findings_(findings), json_(read_json(folder / "manifest.json")) {}

  void run() {
    check_files();
    check_parts();
  }

 private:
  void check_files() {
    std::set<std::string> listed;
    for (const Json& file : json_.value("files", Json::array())) {
      if (!file.is_object()) continue;
      const std::string path = file.value("path", "");
      listed.insert(path);
      const bool program = path.starts_with("robot/") || path.starts_with("duet/") || path == "toolpaths.vtp" || path == "config.resolved.json";
      if (program) check_file(path, file);
    }
    for (const char* name : {"robot", "duet"}) {
      std::error_code ignored;
      for (const auto& entry : std::filesystem::directory_iterator(folder_ / name, ignored)) {
        const std::string path = std::string(name) + "/" + entry.path().filename().string();
        findings_.expect(listed.contains(path), Rule::manifest_hashes, {path, 0}, "is not in manifest.json");
        findings_.expect(good_name(entry.path().filename().string()), Rule::file_names, {path, 0}, "a name with other characters, or too long");
      }
    }
  }

  void check_file(const std::string& path, const Json& file) {
    const Place place{path, 0};
    std::error_code error;
    const auto bytes = std::filesystem::file_size(folder_ / path, error);
    if (error) return findings_.fail(Rule::manifest_hashes, place, "is missing");
    findings_.expect(file.value("bytes", std::uint64_t{0}) == bytes, Rule::manifest_hashes, place, "has another size");
    findings_.expect(file.value("sha256", "") == hash_of(path), Rule::manifest_hashes, place, "has another hash");
  }

  // Of programs it is known already.
  std::string hash_of(const std::string& path) const {
    if (path == programs_.job.file) return programs_.job.sha256;
    for (const RobotPart& part : programs_.parts) {
      if (part.file == path) return part.sha256;
    }
    return sha256_of_file(folder_ / path);
  }

  void check_parts() {
    const Json rows = json_.value("robot_parts", Json::array());
    const Place manifest{"manifest.json", 0};
    findings_.expect(rows.size() == programs_.parts.size(), Rule::manifest_parts, manifest, "other parts than in robot/");
    for (std::size_t i = 0; i < std::min(rows.size(), programs_.parts.size()); ++i) check_part(rows[i], i);
  }

  void check_part(const Json& row, std::size_t i) {
    const RobotPart& part = programs_.parts[i];
    const Place place{part.file, 0};
    findings_.expect(row.value("file", "") == part.file, Rule::manifest_parts, place, "is not the part that the manifest has here");
    std::vector<int> paths;
    for (const PathComment& path : part.paths) paths.push_back(path.path);
    findings_.expect(row.value("paths", std::vector<int>()) == paths, Rule::manifest_parts, place, "prints other paths than the manifest says");
    findings_.expect(row.value("moves", -1) == static_cast<int>(part.moves.size()), Rule::manifest_parts, place, "has another number of moves");
    if (i < programs_.part_s.size()) {
      const double said = row.value("expected_s", -1.0);
      findings_.expect(std::abs(said - programs_.part_s[i]) <= 1.0 + 0.02 * said, Rule::manifest_parts, place, "takes another time than the manifest says");
    }
    const auto offset = row.value("duet_offset", std::size_t{0});
    if (programs_.job.part_offsets.empty()) return;  // the link streams
    const bool right = i < programs_.job.part_offsets.size() && programs_.job.part_offsets[i] == offset &&
                       programs_.job.part_numbers[i] == static_cast<int>(i) + 1;
    findings_.expect(right, Rule::manifest_offsets, place, "its byte offset does not point at the part in the job");
  }

  const Programs& programs_;
  const std::filesystem::path& folder_;
  Findings& findings_;
  Json json_;
};

}  // namespace

void check_manifest(const Programs& programs, const std::filesystem::path& folder, Findings& findings) {
  ManifestCheck(programs, folder, findings).run();
}

}  // namespace curvesup::emitted
