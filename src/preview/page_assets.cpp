#include "page_assets.h"

// Placed into the program by the assembler: no file is needed at run time, and no copy stands in the sources. The build
// names the two places.
#define CURVESUP_EMBED(symbol, path)                                  \
  __asm__(                                                            \
      ".pushsection .rodata\n"                                        \
      ".global curvesup_asset_" #symbol "\n"                          \
      ".global curvesup_asset_" #symbol "_end\n"                      \
      "curvesup_asset_" #symbol ":\n"                                 \
      ".incbin \"" path "\"\n"                                        \
      "curvesup_asset_" #symbol "_end:\n"                             \
      ".byte 0\n"                                                     \
      ".popsection\n");                                               \
  extern "C" const char curvesup_asset_##symbol[], curvesup_asset_##symbol##_end[]; \
  std::string_view curvesup::assets::symbol() {                       \
    return {curvesup_asset_##symbol, static_cast<std::size_t>(curvesup_asset_##symbol##_end - curvesup_asset_##symbol)}; \
  }

CURVESUP_EMBED(page_html, CURVESUP_PAGE_FOLDER "/page.html")
CURVESUP_EMBED(viewer_css, CURVESUP_PAGE_FOLDER "/viewer.css")
CURVESUP_EMBED(viewer_js, CURVESUP_PAGE_FOLDER "/viewer.js")
CURVESUP_EMBED(report_js, CURVESUP_PAGE_FOLDER "/report.js")
CURVESUP_EMBED(three_js, CURVESUP_THREE_JS)
