#include "page_assets.h"

// Placed into the program by the assembler: no file is needed at run time, and no copy stands in the sources. The build
// names the two places.
#define CURVESUP_FILE(path) ".incbin \"" path "\"\n"
#define CURVESUP_PAGE(name) CURVESUP_FILE(CURVESUP_PAGE_FOLDER "/" name)
#define CURVESUP_EMBED(symbol, files)                                 \
  __asm__(                                                            \
      ".pushsection .rodata\n"                                        \
      ".global curvesup_asset_" #symbol "\n"                          \
      ".global curvesup_asset_" #symbol "_end\n"                      \
      "curvesup_asset_" #symbol ":\n"                                 \
      files                                                           \
      "curvesup_asset_" #symbol "_end:\n"                             \
      ".byte 0\n"                                                     \
      ".popsection\n");                                               \
  extern "C" const char curvesup_asset_##symbol[], curvesup_asset_##symbol##_end[]; \
  std::string_view curvesup::assets::symbol() {                       \
    return {curvesup_asset_##symbol, static_cast<std::size_t>(curvesup_asset_##symbol##_end - curvesup_asset_##symbol)}; \
  }

CURVESUP_EMBED(page_html, CURVESUP_PAGE("page.html"))
CURVESUP_EMBED(page_css, CURVESUP_PAGE("page.css"))
CURVESUP_EMBED(report_js, CURVESUP_PAGE("report.js"))
CURVESUP_EMBED(viewer_js,
               CURVESUP_PAGE("data.js") CURVESUP_PAGE("materials.js") CURVESUP_PAGE("model.js") CURVESUP_PAGE("detail.js")
               CURVESUP_PAGE("layers.js") CURVESUP_PAGE("skeleton.js") CURVESUP_PAGE("toolpaths.js") CURVESUP_PAGE("nozzle.js")
               CURVESUP_PAGE("marks.js") CURVESUP_PAGE("camera.js") CURVESUP_PAGE("drawing.js") CURVESUP_PAGE("panel.js")
               CURVESUP_PAGE("keys.js"))
CURVESUP_EMBED(three_js, CURVESUP_FILE(CURVESUP_THREE_JS))
