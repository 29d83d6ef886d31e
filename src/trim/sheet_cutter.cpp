#include "trim/sheet_cutter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
// Samples may be as far apart as this part of the radius of the thinnest strut near them.
constexpr double kEdgePerRadius = 0.35;
// Between samples so many steps apart that all have such a value, their middle among them, everything counts as inside: struts
// are convex, so all that this can overlook is a notch or a hole narrower than that and deep in the solid.
constexpr int kInsideIntervals = 4;
constexpr double kWellInside = 1.0;
// So few unknown samples are taken without asking for a proof first.
constexpr int kFewNodes = 4;
constexpr double kMaxIntervals = 2048.0;
// Cuts of edges, and what of the border is drawn inside a triangle.
constexpr double kCutTolerance_mm = 2e-4, kRootTolerance_mm = 1e-3;
// Where all corners have a lower value than this it is hardly ever provable that a whole triangle is inside.
constexpr double kDeepInside = 1.0;
// Parts of a lattice edge.
constexpr double kBesideNode = 0.02, kOffNode = 1e-5;
// A border that leaves its chord by less gets no further point.
constexpr double kFlatBorder_mm = 3e-3;
// Border points that lie nearer to the line between others are left out.
constexpr double kBorderTolerance_mm = 6e-3;

// The value of a sample that counts as inside or outside: it is made to agree where the two differ.
double on_side(double value, bool inside) {
  return inside ? std::max(value, 0.0) : std::min(value, -std::numeric_limits<double>::min());
}

// Root of the solid between a point inside (value >= 0) and one outside, by Chandrupatla's method (inverse quadratic
// interpolation where that is safe, else bisection), started by one linear step.
Vec3 root_between(LocalSolid& solid, const Vec3& inside, double inside_value, const Vec3& outside, double outside_value,
                  double tolerance_mm = kRootTolerance_mm) {
  const Vec3 along = outside - inside;
  const double tolerance = tolerance_mm / std::max(along.norm(), tolerance_mm);
  double a = 0.0, b = 1.0, value_a = inside_value, value_b = outside_value, c = 0.0, value_c = 0.0;
  double t = value_a / (value_a - value_b);
  for (int i = 0; i < 60; ++i) {
    const double x = a + std::clamp(t, 0.0, 1.0) * (b - a);
    // Where the interpolation moves less than the tolerance, its last point is taken unseen.
    if (std::min(std::abs(x - a), std::abs(b - x)) < tolerance || std::abs(b - a) < tolerance) return inside + x * along;
    const double value = solid.value(inside + x * along);
    if ((value >= 0.0) == (value_a >= 0.0)) {
      c = a;
      value_c = value_a;
    } else {
      c = b;
      b = a;
      value_c = value_b;
      value_b = value_a;
    }
    a = x;
    value_a = value;
    const double xi = (a - b) / (c - b), phi = (value_a - value_b) / (value_c - value_b);
    if (phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi) {
      t = value_a / (value_b - value_a) * value_c / (value_b - value_c) +
          (c - a) / (b - a) * value_a / (value_c - value_a) * value_b / (value_c - value_b);
    } else {
      t = 0.5;
    }
  }
  return inside + a * along;
}

}  // namespace

Index SheetCutter::add_vertex(const Vec3& position) {
  vertices_.push_back(position);
  value_.push_back(kUnknown);
  side_.push_back(TriangleLattice::kUnknownSide);
  return static_cast<Index>(vertices_.size()) - 1;
}

double SheetCutter::value(Index vertex) {
  if (std::isnan(value_[vertex])) value_[vertex] = solid_->value(vertices_[vertex]);
  return value_[vertex];
}

bool SheetCutter::inside(Index vertex) {
  if (side_[vertex] == TriangleLattice::kUnknownSide) side_[vertex] = value(vertex) >= 0.0;
  return side_[vertex] == 1;
}

void SheetCutter::keep(const Corners& t, Index tet) {
  triangles_.push_back(t);
  triangle_tet_.push_back(tet);
}

int SheetCutter::intervals(double length, double step) {
  return static_cast<int>(std::clamp(std::ceil(length / step), 1.0, kMaxIntervals));
}

Index SheetCutter::cut_between(const Vec3& inside, double inside_value, const Vec3& outside, double outside_value) {
  const Index v = add_vertex(root_between(*solid_, inside, inside_value, outside, outside_value, kCutTolerance_mm));
  side_[v] = 1;
  return v;
}

const SheetCutter::Edge& SheetCutter::edge(Index a, Index b) {
  const auto slot = edge_of_.at(a, b);
  if (!slot.is_new) return edges_[slot.value];
  slot.value = static_cast<Index>(edges_.size());
  const Index low = std::min(a, b), high = std::max(a, b);
  const Vec3 start = vertices_[low], along = vertices_[high] - start;
  const double length = along.norm();
  if (!solid_->in_focus(start) || !solid_->in_focus(vertices_[high])) solid_->focus(start + 0.5 * along, 0.5 * length);
  Edge edge;
  // Steps so short that no strut that reaches the ball around the edge slips through between samples.
  edge.step = edge_length_;
  if (length > edge_length_) {
    edge.step = std::max(edge_length_, kEdgePerRadius * solid_->thinnest_radius(start + 0.5 * along, 0.5 * length, edge_length_ / kEdgePerRadius));
  }
  edge.intervals = intervals(length, edge.step);
  edge.first_cut = static_cast<Index>(cuts_.size());
  const int n = edge.intervals;
  edge_side_.assign(n + 1, TriangleLattice::kUnknownSide);
  edge_value_.assign(n + 1, kUnknown);
  edge_side_[0] = inside(low);
  edge_side_[n] = inside(high);
  edge_value_[0] = value_[low];
  edge_value_[n] = value_[high];
  sample_edge(start, along / n, 0, n);
  const auto known_value = [&](int i) {
    if (std::isnan(edge_value_[i])) edge_value_[i] = solid_->value(start + i * (along / n));
    return on_side(edge_value_[i], edge_side_[i] == 1);
  };
  for (int i = 0; i < n; ++i) {
    if (edge_side_[i] == edge_side_[i + 1]) continue;
    const int in = edge_side_[i] == 1 ? i : i + 1, out = 2 * i + 1 - in;
    const Index v = cut_between(start + in * (along / n), known_value(in), start + out * (along / n), known_value(out));
    const double at = length > 0.0 ? (vertices_[v] - start).norm() / length * n - i : 0.5;
    cuts_.push_back({(i + std::clamp(at, 1e-9, 1.0 - 1e-9)) / n, v});
  }
  edge.first_sample = samples_.size();
  samples_.insert(samples_.end(), edge_value_.begin(), edge_value_.begin() + n + 1);
  edge.cut_count = static_cast<Index>(cuts_.size()) - edge.first_cut;
  if (edge.cut_count > 0) {
    edge.side = EdgeSide::mixed;
  } else {
    edge.side = edge_side_[0] == 1 ? EdgeSide::inside : EdgeSide::outside;
  }
  edges_.push_back(edge);
  return edges_.back();
}

void SheetCutter::sample_edge(const Vec3& start, const Vec3& step, int low, int high) {
  if (high - low < 2) return;
  const int middle = (low + high) / 2;
  const Vec3 centre = start + middle * step;
  const auto fill = [&](std::int8_t side) {
    for (int i = low + 1; i < high; ++i) {
      if (edge_side_[i] == TriangleLattice::kUnknownSide) edge_side_[i] = side;
    }
  };
  const bool ends_inside = edge_side_[low] == 1 && edge_side_[high] == 1;
  const bool ends_outside = edge_side_[low] == 0 && edge_side_[high] == 0;
  if (ends_outside && solid_->surely_outside(centre, 0.5 * (high - low) * step.norm())) return fill(0);
  edge_value_[middle] = solid_->value(centre);
  edge_side_[middle] = edge_value_[middle] >= 0.0;
  if (ends_inside && high - low <= kInsideIntervals &&
      std::min({edge_value_[low], edge_value_[middle], edge_value_[high]}) >= kWellInside) {
    return fill(1);
  }
  sample_edge(start, step, low, middle);
  sample_edge(start, step, middle, high);
}

void SheetCutter::add_triangle(const std::array<Index, 3>& t, Index tet) {
  const Vec3 &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
  const std::array<double, 3> length = {(b - a).norm(), (c - b).norm(), (a - c).norm()};
  const int longest = static_cast<int>(std::max_element(length.begin(), length.end()) - length.begin());
  const Vec3 centre = 0.5 * (vertices_[t[longest]] + vertices_[t[(longest + 1) % 3]]);
  const double radius = std::max(0.5 * length[longest], (vertices_[t[(longest + 2) % 3]] - centre).norm());
  solid_->focus(centre, radius);
  const int corners_inside = inside(t[0]) + inside(t[1]) + inside(t[2]);
  const double area = triangle_area(a, b, c);
  if (corners_inside == 0 && solid_->surely_outside(centre, radius)) {
    cut_away_ += area;
    return;
  }
  if (corners_inside == 3 && std::min({value_[t[0]], value_[t[1]], value_[t[2]]}) > kDeepInside && solid_->surely_inside(centre, radius)) {
    keep(t, tet);
    return;
  }
  // The lattice has rows along the shortest edge.
  const int shortest = static_cast<int>(std::min_element(length.begin(), length.end()) - length.begin());
  const Corners corners = {t[(shortest + 2) % 3], t[shortest], t[(shortest + 1) % 3]};
  // A point of the triangle lies in the ball around at least one of its edges.
  double step = std::numeric_limits<double>::infinity();
  int n = 1, k = 1;
  bool whole = corners_inside == 3 || corners_inside == 0;
  for (int e = 0; e < 3; ++e) {
    const Edge& found = edge(corners[e], corners[(e + 1) % 3]);
    (e == 1 ? k : n) = std::max(e == 1 ? k : n, found.intervals);
    step = std::min(step, found.step);
    whole = whole && found.side != EdgeSide::mixed;
  }
  k = std::max(k, intervals(length[shortest], step));
  n = std::max({n, k, intervals(length[longest], step)});
  start_lattice(corners, n, k);
  for (int e = 0; e < 3; ++e) take_edge(corners, e, edge(corners[e], corners[(e + 1) % 3]));
  sample_halves({0, n, 0.0, 1.0});
  whole = whole && lattice_.all_on(corners_inside == 3);
  if (whole) {
    corners_inside == 3 ? keep(t, tet) : void(cut_away_ += area);
    return;
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < lattice_.intervals(j + 1); ++i) {
      using enum TriangleLattice::Link;
      const Node here = {j, i}, down = {j + 1, i}, aside = {j + 1, i + 1}, next = {j, i + 1};
      march_cell({here, down, aside},
                 {&lattice_.crossing(here, kDown), &lattice_.crossing(down, kAlong), &lattice_.crossing(here, kDownAside)});
      if (i == lattice_.intervals(j)) continue;
      march_cell({here, aside, next},
                 {&lattice_.crossing(here, kDownAside), &lattice_.crossing(next, kDown), &lattice_.crossing(here, kAlong)});
    }
  }
  triangulate(tet, area);
}

void SheetCutter::start_lattice(const Corners& t, int n, int k) {
  const Vec3 &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
  lattice_.set(a, b, c, n, k);
  origin_ = a;
  const double ab = (b - a).norm(), ac = (c - a).norm();
  frame_x_ = ab > 0.0 ? Vec3((b - a) / ab) : ac > 0.0 ? Vec3((c - a) / ac) : Vec3(Vec3::UnitX());
  const Vec3 across = (c - a) - frame_x_ * frame_x_.dot(c - a);
  const double height = across.norm();
  frame_y_ = height > 0.0 ? Vec3(across / height) : frame_x_.unitOrthogonal();
  border_.clear();
  flat_.clear();
  fixed_.clear();
  perimeter_.clear();
}

// Puts the sides of an edge's nodes and its cuts into the lattice, and its ends and cuts into the perimeter.
void SheetCutter::take_edge(const Corners& t, int corner, const Edge& edge) {
  using enum TriangleLattice::Link;
  const Index from = t[corner], to = t[(corner + 1) % 3];
  const int rows = lattice_.rows(), n = corner == 1 ? lattice_.intervals(rows) : rows;
  const auto node = [&](int i) -> Node {
    return corner == 0 ? Node{i, 0} : corner == 1 ? Node{rows, i} : Node{n - i, lattice_.intervals(n - i)};
  };
  const auto slot = [&](int i) -> Index& {
    if (corner == 0) return lattice_.crossing(node(i), kDown);
    if (corner == 1) return lattice_.crossing(node(i), kAlong);
    const Node upper = node(i + 1);
    return lattice_.crossing(upper, node(i).i > upper.i ? kDownAside : kDown);
  };
  std::int8_t side = side_[from];
  flat_corners_[corner] = flat_of(vertices_[from]);
  perimeter_.push_back({add_border_point(vertices_[from], from, true), side});
  Index taken = 0;
  for (int i = 0; i <= n; ++i) {
    for (; taken < edge.cut_count; ++taken) {
      const Cut& cut = from < to ? cuts_[edge.first_cut + taken] : cuts_[edge.first_cut + edge.cut_count - 1 - taken];
      const double at = from < to ? cut.at : 1.0 - cut.at;
      if (at * n >= i) break;
      side = 1 - side;
      const Index point = add_border_point(vertices_[cut.vertex], cut.vertex, true);
      perimeter_.push_back({point, side});
      // What two cuts between neighbours enclose is too narrow for the lattice: it ends right here.
      Index& crossing = slot(i - 1);
      if (crossing != kNone) (side == 1 ? border_[crossing].next : border_[point].next) = side == 1 ? point : crossing;
      crossing = crossing == kNone ? point : kNone;
    }
    lattice_.side(node(i)) = side;
    if (i * edge.intervals % n != 0) continue;
    const int sample = i * edge.intervals / n;
    lattice_.value(node(i)) = samples_[edge.first_sample + (from < to ? sample : edge.intervals - sample)];
  }
}

template <typename Visit>
void SheetCutter::for_nodes(const Block& block, const Visit& visit) {
  for (int j = block.top; j <= block.bottom; ++j) {
    const int last = static_cast<int>(std::floor(block.right * lattice_.intervals(j)));
    for (int i = static_cast<int>(std::ceil(block.left * lattice_.intervals(j))); i <= last; ++i) visit(Node{j, i});
  }
}

// Finds the sides of the nodes of a block.
void SheetCutter::sample(const Block& block) {
  std::array<int, 3> count{};  // outside, inside, unknown
  for_nodes(block, [&](Node node) {
    const std::int8_t side = lattice_.side(node);
    ++count[side == TriangleLattice::kUnknownSide ? 2 : side];
  });
  const auto fill = [&](std::int8_t as) {
    for_nodes(block, [&](Node node) {
      if (lattice_.side(node) == TriangleLattice::kUnknownSide) lattice_.side(node) = as;
    });
  };
  if (count[2] == 0) return;
  if (count[2] > kFewNodes) {
    if (count[1] == 0 && proved_outside(block)) return fill(0);
    if (count[0] == 0 && well_inside(block)) return fill(1);
  }
  sample_halves(block);
}

void SheetCutter::sample_halves(const Block& block) {
  const int rows = block.bottom - block.top;
  const double columns = (block.right - block.left) * lattice_.intervals(block.bottom);
  if ((rows + 1) * (columns + 1.0) <= 2.0 * kFewNodes) {
    for_nodes(block, [&](Node node) {
      if (lattice_.side(node) == TriangleLattice::kUnknownSide) lattice_.side(node) = lattice_value(node) >= 0.0;
    });
  } else if (rows >= columns) {
    const int middle = block.top + rows / 2;
    sample({block.top, middle, block.left, block.right});
    sample({middle + 1, block.bottom, block.left, block.right});
  } else {
    const double middle = 0.5 * (block.left + block.right);
    sample({block.top, block.bottom, block.left, middle});
    sample({block.top, block.bottom, middle, block.right});
  }
}

bool SheetCutter::proved_outside(const Block& block) {
  const std::array<Vec3, 4> corners = {lattice_.position(block.top, block.left), lattice_.position(block.top, block.right),
                                       lattice_.position(block.bottom, block.left), lattice_.position(block.bottom, block.right)};
  const Vec3 centre = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  double radius2 = 0.0;
  for (const Vec3& corner : corners) radius2 = std::max(radius2, (corner - centre).squaredNorm());
  return solid_->surely_outside(centre, std::sqrt(radius2));
}

bool SheetCutter::well_inside(const Block& block) {
  const auto first = [&](int j) { return static_cast<int>(std::ceil(block.left * lattice_.intervals(j))); };
  const auto last = [&](int j) { return static_cast<int>(std::floor(block.right * lattice_.intervals(j))); };
  const int middle = (block.top + block.bottom) / 2;
  if (block.bottom - block.top > kInsideIntervals || last(block.bottom) - first(block.bottom) > kInsideIntervals) return false;
  const std::array<Node, 5> nodes = {{{block.top, first(block.top)}, {block.top, last(block.top)},
                                      {block.bottom, first(block.bottom)}, {block.bottom, last(block.bottom)},
                                      {middle, (first(middle) + last(middle)) / 2}}};
  return std::all_of(nodes.begin(), nodes.end(), [&](const Node& node) { return lattice_value(node) >= kWellInside; });
}

double SheetCutter::lattice_value(Node node) {
  double& known = lattice_.value(node);
  if (std::isnan(known)) known = solid_->value(lattice_.position(node));
  return known;
}

Index SheetCutter::add_border_point(const Vec3& position, Index vertex, bool fixed) {
  border_.push_back({position, vertex, kNone});
  flat_.push_back(flat_of(position));
  fixed_.push_back(fixed);
  return static_cast<Index>(border_.size()) - 1;
}

Index SheetCutter::crossing(Node inside, Node outside, Index& slot) {
  if (slot != kNone) return slot;
  const Vec3 a = lattice_.position(inside), b = lattice_.position(outside);
  const double value_a = lattice_value(inside), value_b = lattice_value(outside);
  double t = 0.5;
  if (value_a >= 0.0 && value_b < 0.0) {
    t = (root_between(*solid_, a, value_a, b, value_b) - a).norm() / (b - a).norm();
  } else {  // a node that counts as what its neighbours are: the border passes beside it
    t = value_a < 0.0 ? kBesideNode : 1.0 - kBesideNode;
  }
  // Never at a node, where borders would touch each other or the triangle's edge.
  t = std::clamp(t, kOffNode, 1.0 - kOffNode);
  return slot = add_border_point(a + t * (b - a), kNone, false);
}

// The cases N = 0 .. 3 of one cell of the lattice; slot[c] belongs to the side from node[c] to the next.
void SheetCutter::march_cell(const std::array<Node, 3>& node, const std::array<Index*, 3>& slot) {
  std::array<std::int8_t, 3> side{};
  for (int c = 0; c < 3; ++c) side[c] = lattice_.side(node[c]);
  const int count = side[0] + side[1] + side[2];
  if (count == 0 || count == 3) return;
  const int alone = side[0] != side[1] && side[0] != side[2] ? 0 : side[1] != side[0] && side[1] != side[2] ? 1 : 2;
  const int after = (alone + 1) % 3, before = (alone + 2) % 3;
  const bool alone_inside = count == 1;
  const auto cross = [&](int other, Index& at) {
    return alone_inside ? crossing(node[alone], node[other], at) : crossing(node[other], node[alone], at);
  };
  Index from = cross(after, *slot[alone]), to = cross(before, *slot[before]);
  if (!alone_inside) std::swap(from, to);
  bow(from, to, node);
}

// The border between two crossings of a cell: halved where the surface leaves the chord by more than a little.
void SheetCutter::bow(Index from, Index to, const std::array<Node, 3>& node) {
  const Index between = point_beside(from, to, node);
  if (between == kNone) {
    border_[from].next = to;
    return;
  }
  const Vec3 middle = 0.5 * (border_[from].position + border_[to].position);
  // Half as long, a chord is left by a quarter.
  if ((border_[between].position - middle).norm() < 4.0 * kFlatBorder_mm) {
    border_[from].next = between;
    border_[between].next = to;
  } else {
    bow(from, between, node);
    bow(between, to, node);
  }
}

// A point of the surface beside the middle of the border between two others; kNone where that is straight enough.
Index SheetCutter::point_beside(Index from, Index to, const std::array<Node, 3>& node) {
  const Vec3 chord = border_[to].position - border_[from].position;
  const double length = chord.norm();
  if (length <= 4.0 * kFlatBorder_mm) return kNone;
  const Vec3 middle = 0.5 * (border_[from].position + border_[to].position);
  const double at_middle = solid_->value(middle);
  // Across the chord the solid changes about as it does over the cell.
  const Vec3 across = chord.dot(frame_y_) / length * frame_x_ - chord.dot(frame_x_) / length * frame_y_;  // out of the solid
  double slope = 0.0;
  for (int c = 0; c < 3; ++c) {
    const double beside = (lattice_.position(node[c]) - middle).dot(across);
    const double change = at_middle - lattice_value(node[c]);
    if (beside != 0.0) slope = std::max(slope, change / beside);
  }
  if (!(slope > 0.0)) return kNone;
  const double guess = at_middle / slope;
  if (std::abs(guess) < 0.5 * kFlatBorder_mm) return kNone;
  double reach = 0.0, at_end = at_middle;
  Vec3 end = middle;
  for (const double times : {1.5, 4.0}) {  // a narrow kernel may change less here than over the cell
    reach = std::clamp(times * guess, -0.5 * length, 0.5 * length);
    end = middle + reach * across;
    at_end = solid_->value(end);
    if ((at_end >= 0.0) != (at_middle >= 0.0)) break;
  }
  if ((at_end >= 0.0) == (at_middle >= 0.0)) return kNone;
  // One linear step is near enough where the solid changes as evenly as over the cell; a solid with a jump needs more.
  const double evenness = (at_middle - at_end) / (slope * reach);
  const Vec3 root = evenness > 0.6 && evenness < 1.6 ? Vec3(middle + at_middle / (at_middle - at_end) * reach * across)
                    : at_middle >= 0.0              ? root_between(*solid_, middle, at_middle, end, at_end)
                                                    : root_between(*solid_, end, at_end, middle, at_middle);
  if ((root - middle).squaredNorm() < kFlatBorder_mm * kFlatBorder_mm) return kNone;
  // Inside the cell, so that neither its neighbours nor other borders need to know.
  for (int c = 0; c < 3; ++c) {
    const Vec3 corner = lattice_.position(node[c]);
    const Vec3 side = lattice_.position(node[(c + 1) % 3]) - corner, offset = root - corner;
    if (!(side.dot(frame_x_) * offset.dot(frame_y_) - side.dot(frame_y_) * offset.dot(frame_x_) > 0.0)) return kNone;
  }
  return add_border_point(root, kNone, false);
}

// Puts border points back that were moved out of the triangle.
void SheetCutter::stay_in_triangle() {
  for (std::size_t i = 0; i < evened_.size(); ++i) {
    if (evened_[i] == flat_[i]) continue;
    for (int c = 0; c < 3; ++c) {
      const Vec2 side = flat_corners_[(c + 1) % 3] - flat_corners_[c], offset = evened_[i] - flat_corners_[c];
      if (!(side.x() * offset.y() - side.y() * offset.x() > 0.0)) evened_[i] = flat_[i];
    }
  }
}

void SheetCutter::triangulate(Index tet, double area) {
  for (std::size_t i = 0; i < perimeter_.size(); ++i) {
    if (perimeter_[i][1]) border_[perimeter_[i][0]].next = perimeter_[(i + 1) % perimeter_.size()][0];
  }
  std::vector<Loop> traced, loops;
  for (std::size_t start = 0; start < border_.size(); ++start) {
    Loop loop;
    for (Index i = static_cast<Index>(start); border_[i].next != kNone;) {
      loop.push_back(i);
      i = std::exchange(border_[i].next, kNone);
    }
    if (loop.size() >= 3) traced.push_back(std::move(loop));
  }
  evened_ = flat_;
  for (const Loop& loop : traced) {
    Loop simple = loop;
    simplify_loop(flat_, fixed_, kBorderTolerance_mm, simple, evened_);
    if (simple.size() >= 3) loops.push_back(std::move(simple));
  }
  stay_in_triangle();
  // Borders nearer to each other than the tolerance may have been made to cross: then every point stays.
  auto triangles = triangulate_loops(evened_, loops);
  const auto enclosed = [&] {
    double sum = 0.0;
    for (const Loop& loop : loops) sum += loop_area(evened_, loop);
    return sum;
  };
  const auto covered = [&] {
    double sum = 0.0;
    for (const auto& t : triangles) sum += std::abs(loop_area(evened_, {t[0], t[1], t[2]}));
    return sum;
  };
  if (std::abs(enclosed() - covered()) > 1e-9 * area) {
    evened_ = flat_;
    loops = std::move(traced);
    triangles = triangulate_loops(evened_, loops);
  }
  cut_away_ += area - enclosed();
  for (const auto& t : triangles) {
    Corners corners{};
    for (int c = 0; c < 3; ++c) {
      BorderPoint& point = border_[t[c]];
      if (point.vertex == kNone) point.vertex = add_vertex(origin_ + evened_[t[c]].x() * frame_x_ + evened_[t[c]].y() * frame_y_);
      corners[c] = point.vertex;
    }
    keep(corners, tet);
  }
}

}  // namespace curvesup
