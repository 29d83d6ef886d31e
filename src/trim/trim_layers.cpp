#include <algorithm>
#include <cmath>
#include <numeric>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/trim/trim.h"
#include "trim/sheet_cutter.h"
#include "trim/trimmed_sheet.h"

namespace curvesup {

namespace {

void check_options(const TrimOptions& options) {
  const auto refuse = [](const char* name, double value, const char* limit) {
    throw Error(ErrorKind::usage, "trim", format("%s = %g, it must be %s", name, value, limit));
  };
  if (!(options.edge_length_mm > 0.0)) refuse("edge_length_mm", options.edge_length_mm, "positive");
  if (!(options.min_piece_area_mm2 >= 0.0)) refuse("min_piece_area_mm2", options.min_piece_area_mm2, "0 or more");
  if (!(options.max_height_mm >= 0.0)) refuse("max_height_mm", options.max_height_mm, "0 or more");
  if (options.max_passes < 1) refuse("max_passes", options.max_passes, "1 or more");
}

// Which support tets the solid may reach: most of the support domain is empty, and one bound clears all layers of a tet.
std::vector<char> reachable_tets(const Domain& domain, const Solid& solid, const RunContext& run) {
  std::vector<char> reachable(domain.mesh.tets.size(), 0);
  const std::size_t support = domain.mesh.tets.size() - domain.model_tets;
  parallel_for(support, 4096, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t t = domain.model_tets + begin; t < domain.model_tets + end; ++t) {
      Vec3 centre = Vec3::Zero();
      for (const Index v : domain.mesh.tets[t]) centre += 0.25 * domain.mesh.vertices[v];
      double radius = 0.0;
      for (const Index v : domain.mesh.tets[t]) radius = std::max(radius, (domain.mesh.vertices[v] - centre).norm());
      reachable[t] = solid.bounds(centre, radius).high >= 0.0;
    }
  });
  return reachable;
}

TrimmedSheet trim_sheet(const LayerStack& stack, const Sheet& sheet, const std::vector<char>& reachable, const Solid& solid,
                        const TrimOptions& options) {
  TrimmedSheet result;
  result.head = sheet;
  Index low = std::numeric_limits<Index>::max(), high = 0;
  for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
    for (const Index v : stack.triangles[i]) {
      low = std::min(low, v);
      high = std::max(high, v);
    }
  }
  std::vector<Index> local(high - low + 1, kNone);
  SheetCutter cutter(solid, options.edge_length_mm);
  for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
    auto t = stack.triangles[i];
    const Index tet = stack.triangle_tet[i];
    if (!reachable[tet]) {
      result.cut_away_area += triangle_area(stack.vertices[t[0]], stack.vertices[t[1]], stack.vertices[t[2]]);
      continue;
    }
    for (Index& v : t) {
      Index& id = local[v - low];
      if (id == kNone) {
        id = cutter.add_vertex(stack.vertices[v]);
        result.source.resize(id + 1, kNone);
        result.source[id] = v;
      }
      v = id;
    }
    cutter.add_triangle(t, tet);
  }
  result.cut_away_area += cutter.cut_away_area();
  result.vertices = cutter.take_vertices();
  result.triangles = cutter.take_triangles();
  result.triangle_tet = cutter.take_triangle_tet();
  result.source.resize(result.vertices.size(), kNone);
  return result;
}

struct Quantiles {
  double p50 = 0.0, p99 = 0.0, min = 0.0, max = 0.0;
};

// Of values[i] with weight[i]; values with no weight do not count.
Quantiles quantiles(std::vector<std::pair<double, double>> samples) {
  Quantiles q;
  std::erase_if(samples, [](const auto& s) { return s.second <= 0.0; });
  if (samples.empty()) return q;
  std::sort(samples.begin(), samples.end());
  double total = 0.0, sum = 0.0;
  for (const auto& s : samples) total += s.second;
  q.min = samples.front().first;
  q.p50 = q.p99 = q.max = samples.back().first;
  bool half = false;
  for (const auto& [value, weight] : samples) {
    sum += weight;
    if (!half && sum >= 0.5 * total) {
      q.p50 = value;
      half = true;
    }
    if (sum >= 0.99 * total) {
      q.p99 = value;
      break;
    }
  }
  return q;
}

// Heights of the triangles of one material, with their areas; and the volume over them, clipped at the platform.
struct Heights {
  std::vector<std::pair<double, double>> samples;
  double volume = 0.0;
};

Heights heights(const LayerStack& stack, const ScalarField& field, Material material) {
  Heights result;
  std::vector<double> area_in_tet(field.gradient.size());
  for (const Sheet& sheet : stack.sheets) {
    if (sheet.material != material) continue;
    for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
      const auto& t = stack.triangles[i];
      const Vec3 &a = stack.vertices[t[0]], &b = stack.vertices[t[1]], &c = stack.vertices[t[2]];
      const Index tet = stack.triangle_tet[i];
      const double thickness = 1.0 / (stack.count * sheet.passes * field.gradient[tet].norm());
      const double area = triangle_area(a, b, c);
      const double tip = (a.z() + b.z() + c.z()) / 3.0 + 0.5 * thickness * print_direction(field, tet).z();
      result.volume += area * std::clamp(tip, 0.0, thickness);
      if (sheet.passes == 1) {
        area_in_tet[tet] += area;
      } else {
        result.samples.emplace_back(thickness, area);
      }
    }
  }
  for (std::size_t t = 0; t < area_in_tet.size(); ++t) {
    if (area_in_tet[t] > 0.0) result.samples.emplace_back(1.0 / (stack.count * field.gradient[t].norm()), area_in_tet[t]);
  }
  return result;
}

// Puts the model's sheets and the trimmed ones into one stack in the order of printing.
LayerStack assemble(const LayerStack& untrimmed, std::vector<TrimmedSheet> trimmed) {
  struct Entry {
    Sheet head;
    const TrimmedSheet* support;  // null: a sheet of the untrimmed stack
  };
  std::vector<Entry> order;
  for (const Sheet& sheet : untrimmed.sheets) {
    if (sheet.material == Material::model) order.push_back({sheet, nullptr});
  }
  for (const TrimmedSheet& sheet : trimmed) {
    if (!sheet.triangles.empty()) order.push_back({sheet.head, &sheet});
  }
  std::stable_sort(order.begin(), order.end(), [](const Entry& x, const Entry& y) {
    const Sheet &a = x.head, &b = y.head;
    if (a.layer != b.layer) return a.layer < b.layer;
    // (2 j + 1) / m as exact fractions
    const long left = (2L * a.pass + 1) * b.passes, right = (2L * b.pass + 1) * a.passes;
    if (left != right) return left < right;
    return a.material != b.material ? a.material < b.material : a.passes < b.passes;
  });

  LayerStack stack;
  stack.count = untrimmed.count;
  std::vector<Index> id(untrimmed.vertices.size(), kNone);
  const auto shared = [&](Index v) {
    if (id[v] == kNone) {
      id[v] = static_cast<Index>(stack.vertices.size());
      stack.vertices.push_back(untrimmed.vertices[v]);
    }
    return id[v];
  };
  std::vector<Index> own;
  for (Entry& entry : order) {
    Sheet head = entry.head;
    const Index first = static_cast<Index>(stack.triangles.size());
    if (entry.support == nullptr) {
      for (Index i = head.first_triangle; i < head.first_triangle + head.triangle_count; ++i) {
        const auto& t = untrimmed.triangles[i];
        const Index a = shared(t[0]), b = shared(t[1]), c = shared(t[2]);
        stack.triangles.push_back({a, b, c});
        stack.triangle_tet.push_back(untrimmed.triangle_tet[i]);
      }
    } else {
      const TrimmedSheet& sheet = *entry.support;
      own.assign(sheet.vertices.size(), kNone);
      for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
        std::array<Index, 3> t = sheet.triangles[i];
        for (Index& v : t) {
          if (own[v] == kNone) {
            own[v] = sheet.source[v] != kNone ? shared(sheet.source[v]) : static_cast<Index>(stack.vertices.size());
            if (sheet.source[v] == kNone) stack.vertices.push_back(sheet.vertices[v]);
          }
          v = own[v];
        }
        stack.triangles.push_back(t);
        stack.triangle_tet.push_back(sheet.triangle_tet[i]);
      }
    }
    head.first_triangle = first;
    head.triangle_count = static_cast<Index>(stack.triangles.size()) - first;
    stack.sheets.push_back(head);
  }
  return stack;
}

double support_area(const LayerStack& stack) {
  double sum = 0.0;
  for (const Sheet& sheet : stack.sheets) {
    if (sheet.material != Material::support) continue;
    for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
      const auto& t = stack.triangles[i];
      sum += triangle_area(stack.vertices[t[0]], stack.vertices[t[1]], stack.vertices[t[2]]);
    }
  }
  return sum;
}

// Drops the pieces below the smallest area and lists them.
void remove_small_pieces(TrimmedSheet& sheet, double min_area, std::vector<RemovedPiece>& removed) {
  std::vector<char> keep(sheet.pieces.size(), 1);
  bool any = false;
  for (std::size_t p = 0; p < sheet.pieces.size(); ++p) {
    const Piece& piece = sheet.pieces[p];
    if (piece.area >= min_area) continue;
    keep[p] = 0;
    any = true;
    removed.push_back({sheet.head.layer, sheet.head.pass, sheet.head.passes, piece.area, piece.centroid});
  }
  if (any) keep_pieces(sheet, keep);
}

}  // namespace

TrimResult trim_layers(const Domain& domain, const ScalarField& field, const LayerStack& untrimmed, const Solid& solid,
                       const TrimOptions& options, const RunContext& run) {
  check_options(options);
  const std::vector<char> reachable = reachable_tets(domain, solid, run);
  std::vector<const Sheet*> support_sheets;
  for (const Sheet& sheet : untrimmed.sheets) {
    if (sheet.material == Material::support) support_sheets.push_back(&sheet);
  }

  TrimResult result;
  TrimReport& report = result.report;
  std::vector<TrimmedSheet> trimmed(support_sheets.size());
  std::vector<std::vector<RemovedPiece>> removed(support_sheets.size());
  parallel_for(support_sheets.size(), 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) {
      trimmed[s] = trim_sheet(untrimmed, *support_sheets[s], reachable, solid, options);
      find_pieces(trimmed[s], field, untrimmed.count);
      remove_small_pieces(trimmed[s], options.min_piece_area_mm2, removed[s]);
    }
  });
  for (std::size_t s = 0; s < trimmed.size(); ++s) {
    report.areas.cut_away_mm2 += trimmed[s].cut_away_area;
    for (std::size_t i = 0; i < trimmed[s].triangles.size(); ++i) report.areas.kept_mm2 += trimmed[s].area(i);
    for (const RemovedPiece& piece : removed[s]) report.areas.removed_mm2 += piece.area_mm2;
    report.removed.insert(report.removed.end(), removed[s].begin(), removed[s].end());
    report.support_pieces += static_cast<Index>(trimmed[s].pieces.size() - removed[s].size());
    report.support_layers += !trimmed[s].triangles.empty();
  }
  report.areas.untrimmed_mm2 = support_area(untrimmed);
  result.stack = assemble(untrimmed, std::move(trimmed));
  report.triangles = static_cast<Index>(result.stack.triangles.size());

  const Heights model = heights(untrimmed, field, Material::model);
  const Heights printed = heights(result.stack, field, Material::support);
  report.untrimmed_volume_mm3 = {model.volume, heights(untrimmed, field, Material::support).volume};
  report.printed_volume_mm3 = {model.volume, printed.volume};
  report.model_thickness_p50_mm = quantiles(model.samples).p50;
  const Quantiles height = quantiles(printed.samples);
  report.support_height_min_mm = height.min;
  report.support_height_p50_mm = height.p50;
  report.support_height_p99_mm = height.p99;
  report.support_height_max_mm = height.max;

  const TrimAreas& a = report.areas;
  const double lost = a.untrimmed_mm2 - (a.kept_mm2 + a.in_passes_mm2 + a.cut_away_mm2 + a.removed_mm2);
  report.checks.push_back(check_at_most("trim.area_conserved", std::abs(lost) / std::max(a.untrimmed_mm2, 1.0), 1e-9,
                                        "untrimmed area less kept, cut away and removed, relative"));
  run.log(LogLevel::info, format("trim: %d layers of support, %d pieces, %zu small ones removed", report.support_layers,
                                 report.support_pieces, report.removed.size()));
  return result;
}

}  // namespace curvesup
