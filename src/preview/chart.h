#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

namespace curvesup {

struct ChartColour {
  double r, g, b;
};
inline constexpr ChartColour kModelColour{0.32, 0.47, 0.67}, kSupportColour{0.91, 0.58, 0.13};

// Values over x: a line, points, or bars of the given width that start at `base` (empty: 0) and stand on each other.
struct ChartSeries {
  enum class Form { line, points, bars };
  std::string name;  // empty: not in the legend
  ChartColour colour{};
  Form form = Form::line;
  std::vector<double> x, y;
  std::vector<double> base = {};
  double bar_width = 1.0;
};

// One pair of axes; panels of a chart stand below each other and share x.
struct ChartPanel {
  std::string y_label;
  std::vector<ChartSeries> series;
  bool y_from_zero = true;
  double y_most = std::numeric_limits<double>::infinity();  // the axis ends here, whatever is higher
};

struct Chart {
  std::string title, x_label;
  std::vector<ChartPanel> panels;
  // Names instead of numbers below x = 0, 1, 2, ...; empty: numbers.
  std::vector<std::string> x_names = {};
};

// Round numbers within [low, high], about `wanted` of them, as multiples of 1, 2 or 5 times a power of ten.
[[nodiscard]] std::vector<double> round_ticks(double low, double high, int wanted);

// The chart as a PNG file. Draws in memory; the same chart gives the same bytes with the same font installed.
[[nodiscard]] std::string draw_chart(const Chart& chart);

}  // namespace curvesup
