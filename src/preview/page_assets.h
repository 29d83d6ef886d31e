#pragma once

#include <string_view>

// The files that a page is made of, as they were when the program was built.
namespace curvesup::assets {

[[nodiscard]] std::string_view page_html();
[[nodiscard]] std::string_view page_css();
[[nodiscard]] std::string_view viewer_js();
[[nodiscard]] std::string_view report_js();
[[nodiscard]] std::string_view three_js();  // Debian's libjs-three, MIT licence

}  // namespace curvesup::assets
