#include <gtest/gtest.h>

#include <clocale>
#include <numeric>

#include "curvesup/core/angle.h"
#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"

namespace curvesup {
namespace {

TEST(Error, OneLineNamesKindPlaceAndRemedy) {
  const Error error(ErrorKind::input, "model.tet:12", "index 99 out of range", "indices are 0-based");
  EXPECT_STREQ(error.what(), "[input] model.tet:12: index 99 out of range (indices are 0-based)");
  EXPECT_EQ(exit_code(error.kind()), 3);
}

TEST(Parallel, EveryElementOnceForAnyThreadCount) {
  for (int threads : {1, 2, 5}) {
    std::vector<int> seen(1001, 0);
    RunContext run;
    run.threads = threads;
    parallel_for(seen.size(), 10, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
      EXPECT_EQ(chunk, begin / 10);
      for (std::size_t i = begin; i < end; ++i) ++seen[i];
    });
    EXPECT_EQ(std::accumulate(seen.begin(), seen.end(), 0), 1001);
  }
}

TEST(Parallel, TheLowestFailingChunkIsReported) {
  RunContext run;
  run.threads = 2;
  try {
    parallel_for(100, 1, run, [](std::size_t begin, std::size_t, std::size_t) {
      if (begin == 3 || begin == 60) throw Error(ErrorKind::internal, std::to_string(begin), "x");
    });
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), "3");
  }
}

TEST(RunContext, AStopIsAnInterruptedError) {
  std::stop_source source;
  RunContext run;
  run.stop = source.get_token();
  EXPECT_NO_THROW(run.check_stop());
  source.request_stop();
  EXPECT_THROW(run.check_stop(), Error);
}

TEST(Format, NumbersReadBackAndIgnoreTheLocale) {
  std::setlocale(LC_ALL, "de_DE.UTF-8");
  EXPECT_EQ(format("%.3f", 1.5), "1.500");
  const std::string text = shortest(0.1);
  double value = 0;
  EXPECT_TRUE(parse_number(text.data(), text.data() + text.size(), value));
  EXPECT_EQ(value, 0.1);
  EXPECT_FALSE(parse_number(text.data(), text.data(), value));
  const std::string bad = "1.5x", nan = "nan";
  EXPECT_FALSE(parse_number(bad.data(), bad.data() + bad.size(), value));
  EXPECT_FALSE(parse_number(nan.data(), nan.data() + nan.size(), value));
  std::setlocale(LC_ALL, "C");
}

TEST(Angle, DegreesAndRadiansAgree) {
  EXPECT_NEAR(Angle::degrees(45).radians(), 0.785398163397448, 1e-15);
  EXPECT_LT(Angle::degrees(44), Angle::degrees(45));
}

}  // namespace
}  // namespace curvesup
