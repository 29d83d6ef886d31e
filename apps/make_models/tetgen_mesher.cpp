#include "tetgen_mesher.h"

#ifndef TETLIBRARY
#define TETLIBRARY
#endif
#include <tetgen.h>
#undef REAL

#include <algorithm>
#include <string>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"

namespace make_models {

using curvesup::Index;
using curvesup::TetMesh;
using curvesup::TriangleMesh;

TetMesh fill_with_tets(const TriangleMesh& surface, double max_volume_mm3) {
  tetgenio in, out;
  in.numberofpoints = static_cast<int>(surface.vertices.size());
  in.pointlist = new double[3 * surface.vertices.size()];
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    std::copy_n(surface.vertices[v].data(), 3, in.pointlist + 3 * v);
  }
  in.numberoffacets = static_cast<int>(surface.triangles.size());
  in.facetlist = new tetgenio::facet[surface.triangles.size()];
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    tetgenio::facet& facet = in.facetlist[t];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::init(facet.polygonlist);
    facet.polygonlist[0].numberofvertices = 3;
    facet.polygonlist[0].vertexlist = new int[3];
    std::copy_n(surface.triangles[t].data(), 3, facet.polygonlist[0].vertexlist);
  }
  std::string switches = "pYq1.414a" + curvesup::shortest(max_volume_mm3) + "Q";
  try {
    tetrahedralize(switches.data(), &in, &out);
  } catch (int code) {
    throw curvesup::Error(curvesup::ErrorKind::geometry, "tetgen", "fails with code " + std::to_string(code));
  }
  TetMesh mesh;
  for (int v = 0; v < out.numberofpoints; ++v) {
    mesh.vertices.emplace_back(out.pointlist[3 * v], out.pointlist[3 * v + 1], out.pointlist[3 * v + 2]);
  }
  for (int t = 0; t < out.numberoftetrahedra; ++t) {
    std::array<Index, 4> tet{};
    std::copy_n(out.tetrahedronlist + 4 * t, 4, tet.begin());
    mesh.tets.push_back(tet);
    if (curvesup::tet_volume(mesh, t) < 0.0) std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
  }
  return mesh;
}

}  // namespace make_models
