#pragma once

namespace curvesup::cli {

// Parses the command line, runs one command, and returns the documented exit code. Never throws.
int run(int argc, char** argv);

}  // namespace curvesup::cli
