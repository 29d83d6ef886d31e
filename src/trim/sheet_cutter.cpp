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
// Of where the border crosses the way between two samples.
constexpr double kRootTolerance_mm = 2e-4;
constexpr double kUnseenMove = 0.03;  // of the way between two samples
// Where all corners have a lower value than this it is hardly ever provable that a whole polygon is inside.
constexpr double kDeepInside = 1.0;
// Parts of a lattice edge.
constexpr double kBesideNode = 0.02, kOffNode = 1e-5;
// What a border point keeps of its distance from a side of its cell.
constexpr double kBesideSide = 0.02;
// A border that leaves its chord by less gets no further point.
constexpr double kFlatBorder_mm = 4e-3;
// Border points that lie nearer to the line between others are left out.
constexpr double kBorderTolerance_mm = 8e-3;

// The value of a sample that counts as inside or outside: it is made to agree where the two differ.
double on_side(double value, bool inside) {
  return inside ? std::max(value, 0.0) : std::min(value, -std::numeric_limits<double>::min());
}

// Across a strut this is nearly a parabola, where the value itself is nearly flat at its reach and steep inside.
double evened(double value) { return std::sqrt(std::max(0.0, 1.0 + value)) - 1.0; }

// Root of the solid between a point inside (value >= 0) and one outside, by Chandrupatla's method (inverse quadratic
// interpolation where that is safe, else bisection), started by one linear step.
Vec3 root_between(LocalSolid& solid, const Vec3& inside, double inside_value, const Vec3& outside, double outside_value) {
  const Vec3 along = outside - inside;
  const double tolerance = kRootTolerance_mm / std::max(along.norm(), kRootTolerance_mm);
  double a = 0.0, b = 1.0, value_a = evened(inside_value), value_b = evened(outside_value), c = 0.0, value_c = 0.0;
  double t = value_a > value_b ? value_a / (value_a - value_b) : 0.5;
  for (int i = 0; i < 60; ++i) {
    const double x = a + std::clamp(t, 0.0, 1.0) * (b - a);
    // Where the interpolation moves by little, its last point is taken unseen: it is far better than the one before.
    const double enough = i > 0 ? std::max(tolerance, kUnseenMove) : tolerance;
    if (std::min(std::abs(x - a), std::abs(b - x)) < enough || std::abs(b - a) < tolerance) return inside + x * along;
    const double value = evened(solid.value(inside + x * along));
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
  side_.push_back(RowLattice::kUnknownSide);
  return static_cast<Index>(vertices_.size()) - 1;
}

double SheetCutter::value(Index vertex) {
  if (std::isnan(value_[vertex])) value_[vertex] = solid_->value(vertices_[vertex]);
  return value_[vertex];
}

bool SheetCutter::inside(Index vertex) {
  if (side_[vertex] == RowLattice::kUnknownSide) side_[vertex] = value(vertex) >= 0.0;
  return side_[vertex] == 1;
}

void SheetCutter::keep(const std::array<Index, 3>& triangle, Index tet) {
  triangles_.push_back(triangle);
  triangle_tet_.push_back(tet);
}

int SheetCutter::intervals(double length, double step) {
  return static_cast<int>(std::clamp(std::ceil(length / step), 1.0, kMaxIntervals));
}

Index SheetCutter::cut_between(const Vec3& inside, double inside_value, const Vec3& outside, double outside_value) {
  const Index v = add_vertex(root_between(*solid_, inside, inside_value, outside, outside_value));
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
    const Vec3 middle = start + 0.5 * along;
    const double rest = solid_->thinnest_rest(middle, 0.5 * length);
    const auto thinnest = [&] { return solid_->thinnest_radius(middle, 0.5 * length, edge_length_ / kEdgePerRadius); };
    edge.step = rest > 0.0 ? std::min(edge_length_, kEdgePerRadius * rest) : std::max(edge_length_, kEdgePerRadius * thinnest());
  }
  edge.intervals = intervals(length, edge.step);
  edge.first_cut = static_cast<Index>(cuts_.size());
  const int n = edge.intervals;
  edge_side_.assign(n + 1, RowLattice::kUnknownSide);
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
      if (edge_side_[i] == RowLattice::kUnknownSide) edge_side_[i] = side;
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

void SheetCutter::add_polygon(std::span<const Index> corners, Index tet, const Neighbourhood& around) {
  // A ball around it: that of its longest side or diagonal, or a larger one.
  Vec3 centre = Vec3::Zero();
  double longest2 = -1.0, area = 0.0, radius2 = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vec3 &p = vertices_[corners[i]], &q = vertices_[corners[j]];
      if ((p - q).squaredNorm() <= longest2) continue;
      longest2 = (p - q).squaredNorm();
      centre = 0.5 * (p + q);
    }
    if (i >= 2) area += triangle_area(vertices_[corners[0]], vertices_[corners[i - 1]], vertices_[corners[i]]);
  }
  double half_height = 0.0;
  for (const Index v : corners) {
    radius2 = std::max(radius2, (vertices_[v] - centre).squaredNorm());
    half_height = std::max(half_height, std::abs(around.up.dot(vertices_[v] - centre)));
  }
  const double radius = std::sqrt(radius2);
  solid_->focus(centre, radius, around, half_height);
  const auto keep_whole = [&] {
    for (std::size_t i = 2; i < corners.size(); ++i) keep({corners[0], corners[i - 1], corners[i]}, tet);
  };
  const bool all_inside = std::all_of(corners.begin(), corners.end(), [&](Index v) { return inside(v); });
  const bool all_outside = !all_inside && std::none_of(corners.begin(), corners.end(), [&](Index v) { return inside(v); });
  if (all_outside && solid_->surely_outside(centre, radius)) {
    cut_away_ += area;
    return;
  }
  const bool deep = all_inside && std::all_of(corners.begin(), corners.end(), [&](Index v) { return value_[v] > kDeepInside; });
  if (deep && solid_->surely_inside(centre, radius)) return keep_whole();

  const Corners ring = corners.size() == 3 ? rows_of_triangle(corners) : rows_of_quadrilateral(corners);
  const int sides = static_cast<int>(corners.size());
  // A point of the polygon lies in the ball around at least one of its edges.
  double step = std::numeric_limits<double>::infinity();
  bool mixed = false;
  std::array<Edge, 4> edges{};
  for (int e = 0; e < sides; ++e) {
    edges[e] = edge(ring[e], ring[(e + 1) % 4]);
    step = std::min(step, edges[e].step);
    mixed = mixed || edges[e].side == EdgeSide::mixed;
  }
  start_lattice(ring, edges, step);
  for (int e = 0; e < sides; ++e) take_edge(ring, e, edges[e]);
  const int rows = lattice_.rows();
  sample_halves({0, rows, 0.0, 1.0});
  if (!mixed && (all_inside || all_outside) && lattice_.all_on(all_inside)) {
    all_inside ? keep_whole() : void(cut_away_ += area);
    return;
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < lattice_.intervals(j + 1); ++i) {
      using enum RowLattice::Link;
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

double SheetCutter::length(Index a, Index b) const { return (vertices_[b] - vertices_[a]).norm(); }

// Rows along the shortest side.
SheetCutter::Corners SheetCutter::rows_of_triangle(std::span<const Index> t) const {
  const std::array<double, 3> side = {length(t[0], t[1]), length(t[1], t[2]), length(t[2], t[0])};
  const auto shortest = std::min_element(side.begin(), side.end()) - side.begin();
  const Index apex = t[(shortest + 2) % 3];
  return {apex, t[shortest], t[(shortest + 1) % 3], apex};
}

// Rows along the two opposite sides that are shorter, the longer one of them last.
SheetCutter::Corners SheetCutter::rows_of_quadrilateral(std::span<const Index> q) const {
  std::array<double, 4> side{};
  for (int c = 0; c < 4; ++c) side[c] = length(q[c], q[(c + 1) % 4]);
  const int pair = std::max(side[0], side[2]) < std::max(side[1], side[3]) ? 0 : 1;
  const int last = side[pair] > side[pair + 2] ? pair : pair + 2;
  return {q[(last + 3) % 4], q[last], q[(last + 1) % 4], q[(last + 2) % 4]};
}

void SheetCutter::start_lattice(const Corners& ring, const std::array<Edge, 4>& edges, double step) {
  const auto count = [&](int side) {
    const Index from = ring[side], to = ring[(side + 1) % 4];
    return from == to ? 0 : std::max(edges[side].intervals, intervals(length(from, to), step));
  };
  RowLattice::Size size{std::max(count(0), count(2)), count(3), count(1)};
  size.bottom = std::max(size.top, size.bottom);
  size.rows = std::max(size.rows, size.bottom - size.top);
  const std::array<Vec3, 4> at = {vertices_[ring[0]], vertices_[ring[1]], vertices_[ring[2]], vertices_[ring[3]]};
  lattice_.set(at, size);

  // A circle of two steps, smaller than any strut here, leaves such a chord by less than kFlatBorder_mm.
  straight_length_ = std::sqrt(8.0 * 2.0 * step * kFlatBorder_mm);
  origin_ = at[0];
  const Vec3 side = at[1] - at[0], diagonal = at[2] - at[0];
  frame_x_ = (side.squaredNorm() > 0.0 ? side : diagonal.squaredNorm() > 0.0 ? diagonal : Vec3(Vec3::UnitX())).normalized();
  frame_y_ = Vec3::Zero();
  for (const Vec3& p : {at[2], at[3]}) {
    const Vec3 across = (p - at[0]) - frame_x_ * frame_x_.dot(p - at[0]);
    if (across.squaredNorm() > frame_y_.squaredNorm()) frame_y_ = across;
  }
  frame_y_ = frame_y_.squaredNorm() > 0.0 ? frame_y_.normalized() : frame_x_.unitOrthogonal();
  for (int c = 0; c < 4; ++c) flat_corners_[c] = flat_of(at[c]);
  border_.clear();
  flat_.clear();
  fixed_.clear();
  perimeter_.clear();
}

// Puts the sides of an edge's nodes and its cuts into the lattice, and its ends and cuts into the perimeter.
void SheetCutter::take_edge(const Corners& ring, int corner, const Edge& edge) {
  using enum RowLattice::Link;
  const Index from = ring[corner], to = ring[(corner + 1) % 4];
  const int rows = lattice_.rows(), n = corner == 1 ? lattice_.intervals(rows) : corner == 3 ? lattice_.intervals(0) : rows;
  const auto node = [&](int i) -> Node {
    return corner == 0   ? Node{i, 0}
           : corner == 1 ? Node{rows, i}
           : corner == 2 ? Node{n - i, lattice_.intervals(n - i)}
                         : Node{0, n - i};
  };
  const auto slot = [&](int i) -> Index& {
    const Node here = node(i), next = node(i + 1);
    if (corner < 2) return lattice_.crossing(here, corner == 0 ? kDown : kAlong);
    return lattice_.crossing(next, corner == 3 ? kAlong : here.i > next.i ? kDownAside : kDown);
  };
  std::int8_t side = side_[from];
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
    ++count[side == RowLattice::kUnknownSide ? 2 : side];
  });
  const auto fill = [&](std::int8_t as) {
    for_nodes(block, [&](Node node) {
      if (lattice_.side(node) == RowLattice::kUnknownSide) lattice_.side(node) = as;
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
      if (lattice_.side(node) == RowLattice::kUnknownSide) lattice_.side(node) = lattice_value(node) >= 0.0;
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
  if (length <= straight_length_) return kNone;
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
  // Inside the cell, so that neither its neighbours nor other borders need to know.
  double part = 1.0;
  for (int c = 0; c < 3; ++c) {
    const Vec3 corner = lattice_.position(node[c]), side = lattice_.position(node[(c + 1) % 3]) - corner;
    const Vec3 in = side.dot(frame_x_) * frame_y_ - side.dot(frame_y_) * frame_x_;
    const double from_side = in.dot(middle - corner), root_from_side = in.dot(root - corner);
    if (root_from_side < kBesideSide * from_side) part = std::min(part, (1.0 - kBesideSide) * from_side / (from_side - root_from_side));
  }
  const Vec3 offset = part * (root - middle);
  if (!(offset.squaredNorm() >= kFlatBorder_mm * kFlatBorder_mm)) return kNone;
  return add_border_point(middle + offset, kNone, false);
}

// Puts border points back that were moved out of the polygon.
void SheetCutter::stay_in_polygon() {
  for (std::size_t i = 0; i < evened_.size(); ++i) {
    if (evened_[i] == flat_[i]) continue;
    for (int c = 0; c < 4; ++c) {
      const Vec2 side = flat_corners_[(c + 1) % 4] - flat_corners_[c], offset = evened_[i] - flat_corners_[c];
      if (side.squaredNorm() > 0.0 && !(side.x() * offset.y() - side.y() * offset.x() > 0.0)) evened_[i] = flat_[i];
    }
  }
}

void SheetCutter::triangulate(Index tet, double area) {
  for (std::size_t i = 0; i < perimeter_.size(); ++i) {
    if (perimeter_[i][1]) border_[perimeter_[i][0]].next = perimeter_[(i + 1) % perimeter_.size()][0];
  }
  std::vector<Loop> traced, loops;
  for (std::size_t start = 0; start < border_.size(); ++start) {
    if (border_[start].next == kNone) continue;
    Loop loop;
    loop.reserve(border_.size());
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
  stay_in_polygon();
  // Borders nearer to each other than the tolerance may have been made to cross: then every point stays.
  auto triangles = triangulate_loops(evened_, loops);
  const auto enclosed = [&] {
    double sum = 0.0;
    for (const Loop& loop : loops) sum += loop_area(evened_, loop);
    return sum;
  };
  const auto covered = [&] {
    double sum = 0.0;
    for (const auto& t : triangles) sum += std::abs(loop_area(evened_, t));
    return sum;
  };
  if (std::abs(enclosed() - covered()) > 1e-9 * area) {
    evened_ = flat_;
    loops = std::move(traced);
    triangles = triangulate_loops(evened_, loops);
  }
  cut_away_ += area - enclosed();
  for (const auto& t : triangles) {
    std::array<Index, 3> corners{};
    for (int c = 0; c < 3; ++c) {
      BorderPoint& point = border_[t[c]];
      if (point.vertex == kNone) point.vertex = add_vertex(origin_ + evened_[t[c]].x() * frame_x_ + evened_[t[c]].y() * frame_y_);
      corners[c] = point.vertex;
    }
    keep(corners, tet);
  }
}

}  // namespace curvesup
