#include "mesh/tetgen_wrapper.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <new>
#include <thread>
#include <utility>

#include "curvesup/core/error.h"

// The header defines terminatetetgen() inline: it frees the mesh and throws, and unwinding then frees the mesh again. Its
// name is turned aside here and a definition that only throws takes its place; the library's own symbol is weak.
#define terminatetetgen tetgen_header_terminate
#include <tetgen.h>
#undef terminatetetgen
#undef REAL

void terminatetetgen(tetgenmesh*, int code) { throw code; }

namespace curvesup {
namespace {

struct Reason {
  const char* what;
  const char* remedy;
};

Reason reason_of(int code) {
  switch (code) {
    case 1:
      return {"TetGen ran out of memory", "allow larger tets"};
    case 3:
      return {"the surface intersects itself or the hull", "repair the mesh, or enlarge the hull's margin"};
    case 4:
      return {"the surface has a feature too small to mesh", "merge vertices that nearly coincide"};
    case 5:
      return {"two facets of the surface nearly touch or overlap", "move them apart, or enlarge the hull's margin"};
    case 10:
      return {"TetGen refused the input", "check the surface for degenerate triangles and duplicate vertices"};
    default:
      return {"TetGen failed with an internal error", "try another tet size or another hull edge length"};
  }
}

// tetgenio frees its lists with delete[] or free-like rules of its own: allocate exactly as it expects.
void fill(tetgenio& in, const PiecewiseComplex& complex) {
  in.firstnumber = 0;
  in.numberofpoints = static_cast<int>(complex.vertices.size());
  in.pointlist = new double[3 * complex.vertices.size()];
  for (std::size_t v = 0; v < complex.vertices.size(); ++v) {
    for (int c = 0; c < 3; ++c) in.pointlist[3 * v + c] = complex.vertices[v][c];
  }
  in.numberoffacets = static_cast<int>(complex.facets.size());
  in.facetlist = new tetgenio::facet[complex.facets.size()];
  for (std::size_t f = 0; f < complex.facets.size(); ++f) tetgenio::init(&in.facetlist[f]);
  for (std::size_t f = 0; f < complex.facets.size(); ++f) {
    auto& facet = in.facetlist[f];
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    auto& polygon = facet.polygonlist[0];
    tetgenio::init(&polygon);
    polygon.vertexlist = new int[3];
    polygon.numberofvertices = 3;
    std::copy(complex.facets[f].begin(), complex.facets[f].end(), polygon.vertexlist);
  }
  if (complex.holes.empty()) return;
  in.numberofholes = static_cast<int>(complex.holes.size());
  in.holelist = new double[3 * complex.holes.size()];
  for (std::size_t h = 0; h < complex.holes.size(); ++h) {
    for (int c = 0; c < 3; ++c) in.holelist[3 * h + c] = complex.holes[h][c];
  }
}

TetMesh read(const tetgenio& out) {
  TetMesh mesh;
  mesh.vertices.resize(out.numberofpoints);
  for (int v = 0; v < out.numberofpoints; ++v) {
    mesh.vertices[v] = Vec3(out.pointlist[3 * v], out.pointlist[3 * v + 1], out.pointlist[3 * v + 2]);
  }
  mesh.tets.resize(out.numberoftetrahedra);
  for (int t = 0; t < out.numberoftetrahedra; ++t) {
    std::copy_n(out.tetrahedronlist + static_cast<std::ptrdiff_t>(t) * out.numberofcorners, 4, mesh.tets[t].begin());
    if (tet_volume(mesh, t) < 0.0) std::swap(mesh.tets[t][2], mesh.tets[t][3]);
  }
  return mesh;
}

// Throws TetGen's code.
TetMesh fill_with_tets(tetgenio& in, const TetrahedralizeOptions& options) {
  tetgenio out;
  // The numbers go past the switches: TetGen would read them in the locale of the process.
  char switches[] = "pYq2a1Q";
  tetgenbehavior behavior;
  if (!behavior.parse_commandline(switches)) throw 10;
  behavior.minratio = options.radius_edge_ratio;
  behavior.maxvolume = options.max_tet_volume_mm3;
  ::tetrahedralize(&behavior, &in, &out);
  if (out.numberoftetrahedra == 0 || out.numberofpoints < in.numberofpoints) throw 2;
  return read(out);
}

// The same in a thread that owns all it uses, so that it can be left alone when a stop is asked for.
TetMesh fill_beside(std::unique_ptr<tetgenio> in, const TetrahedralizeOptions& options, const RunContext& run) {
  std::packaged_task<TetMesh()> task([in = std::move(in), options] { return fill_with_tets(*in, options); });
  std::future<TetMesh> mesh = task.get_future();
  std::thread(std::move(task)).detach();
  while (mesh.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) run.check_stop();
  return mesh.get();
}

}  // namespace

void drop_unused_vertices(TetMesh& mesh, Index kept) {
  std::vector<Index> id(mesh.vertices.size(), kNone);
  for (Index v = 0; v < kept; ++v) id[v] = v;
  for (const auto& tet : mesh.tets) {
    for (const Index v : tet) id[v] = v;
  }
  Index next = 0;
  for (std::size_t v = 0; v < id.size(); ++v) {
    if (id[v] == kNone) continue;
    mesh.vertices[next] = mesh.vertices[v];
    id[v] = next++;
  }
  mesh.vertices.resize(next);
  for (auto& tet : mesh.tets) {
    for (Index& v : tet) v = id[v];
  }
}

TetMesh tetrahedralize(const PiecewiseComplex& complex, const TetrahedralizeOptions& options, const RunContext& run) {
  if (complex.facets.empty()) {
    throw Error(ErrorKind::geometry, options.where, "there is no surface to fill", "check the input mesh");
  }
  TetMesh mesh;
  try {
    auto in = std::make_unique<tetgenio>();
    fill(*in, complex);
    mesh = run.stop.stop_possible() ? fill_beside(std::move(in), options, run) : fill_with_tets(*in, options);
  } catch (const int code) {
    const Reason reason = reason_of(code);
    throw Error(ErrorKind::geometry, options.where, reason.what, reason.remedy);
  } catch (const std::bad_alloc&) {
    const Reason reason = reason_of(1);
    throw Error(ErrorKind::geometry, options.where, reason.what, reason.remedy);
  }
  drop_unused_vertices(mesh, static_cast<Index>(complex.vertices.size()));
  return mesh;
}

}  // namespace curvesup
