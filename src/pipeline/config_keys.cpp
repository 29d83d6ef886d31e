#include "curvesup/pipeline/config.h"

namespace curvesup {

std::span<const ConfigKey> config_keys() {
  static const std::vector<ConfigKey> keys = [] {
    std::vector<ConfigKey> all;
    for (auto* part : {&part_keys, &machine_keys, &output_keys}) {
      for (ConfigKey& key : part()) all.push_back(std::move(key));
    }
    return all;
  }();
  return keys;
}

}  // namespace curvesup
