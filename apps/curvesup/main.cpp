#include "commands.h"

int main(int argc, char** argv) { return curvesup::cli::run(argc, argv); }
