// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/arm_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "cli/arm/panel.h"
#include "planner/workspace.h"

namespace corbot::cli {
namespace {

/// Positions in the picture, px. The picture is as high as its panels need.
struct Layout {
  double width, panel_width, panel_height, top;
  std::array<double, 2> lefts;
  double joint_radius, foot;
};
constexpr Layout kFull{600.0, 220.0, 280.0, 84.0, {60.0, 352.0}, 5.5, 26.0};
constexpr Layout kThumbnail{200.0, 90.0, 100.0, 6.0, {5.0, 105.0}, 2.8, 12.0};

// Colours of Okabe and Ito (2008), which colour-blind readers can distinguish. A dark screen gets the lighter
// ones.
constexpr const char* kStyle =
    "text{font:15px "
    "system-ui,sans-serif;fill:#333}.bold{font-weight:600}.title{font-size:20px;font-weight:600}"
    ".middle{text-anchor:middle}.end{text-anchor:end}.back{fill:#fff}.grid{stroke:#ccc;fill:none}"
    ".reach{fill:#56b4e9;fill-opacity:.4;fill-rule:evenodd;stroke:#0072b2;stroke-width:1.5;stroke-linejoin:"
    "round}"
    ".forbidden{fill:#cc79a7;fill-opacity:.3;fill-rule:evenodd;stroke:#cc79a7}"
    ".arm,.halo{fill:none;stroke:#d55e00;stroke-linejoin:round;stroke-linecap:round}.halo{stroke:#fff}"
    ".joint{fill:#fff;stroke:#222;stroke-width:2}.tool{fill:#222;stroke:#fff}.foot{fill:#777}"
    ".bar{stroke:#333;stroke-width:2;fill:none}"
    "@media (prefers-color-scheme:dark){text{fill:#ddd}.back{fill:#0d1117}.grid{stroke:#3a414a}"
    ".reach{fill-opacity:.3;stroke:#56b4e9}.arm{stroke:#e69f00}.halo{stroke:#0d1117}"
    ".joint{fill:#0d1117;stroke:#eee}.tool{fill:#eee;stroke:#0d1117}.foot{fill:#999}.bar{stroke:#ddd}}";
constexpr const char* kFullLines = ".arm{stroke-width:5}.halo{stroke-width:8}";
constexpr const char* kThinLines =
    "text{font-size:12px}.arm{stroke-width:2.5}.halo{stroke-width:4}.reach{stroke-width:1}.joint{stroke-"
    "width:1.2}";

/// Returns the vertical plane through axis 1 and the tool. For other arms returns the plane of x and z.
DrawnPlane side_plane(const Workspace& space, const ArmLine& line) {
  DrawnPlane plane;
  if (!space.about_axis) return plane;
  plane.origin_m = {space.axis_m[0], space.axis_m[1], 0.0};
  const Vector3 away = line.points_m.back() - space.axis_m;
  const double length = std::hypot(away[0], away[1]);
  if (length > 1e-3) plane.right = {away[0] / length, away[1] / length, 0.0};
  return plane;
}

std::string text_at(double x, double y, const char* style, const std::string& text) {
  return fmt::format("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", style, x, y, text);
}

std::string axes_of(const Panel& panel, const char* title, const char* right_name, const char* up_name) {
  return text_at(panel.left(), kFull.top - 14.0, "bold", title) +
         text_at(panel.left() - 7.0, kFull.top - 14.0, "end", up_name) +
         text_at(0.5 * (panel.left() + panel.right()), panel.bottom() + 42.0, "middle", right_name);
}

std::string legend(const ArmLine& line, bool has_workspace, double y) {
  const double symbol = y - 5.0;
  std::string text =
      fmt::format("<rect class=\"reach\" x=\"24\" y=\"{:.1f}\" width=\"26\" height=\"13\"/>\n", y - 11.0);
  text += text_at(58, y, "", "reach of the tool centre point") + tool_symbol(312, symbol, 6.5);
  text += text_at(326, y, "", "tool centre point");
  text += fmt::format("<path class=\"arm\" d=\"M26 {:.1f}h22\"/>\n", symbol + 28.0) +
          text_at(58, y + 28.0, "", "link");
  double x = 120.0;
  for (const JointKind kind : {JointKind::kRotary, JointKind::kPrismatic}) {
    const bool has = std::any_of(line.joints.begin(), line.joints.end(),
                                 [kind](const ArmLine::Joint& joint) { return joint.kind == kind; });
    if (!has) continue;
    text += joint_symbol(kind, x, symbol + 28.0, kFull.joint_radius);
    text += text_at(x + 14.0, y + 28.0, "",
                    kind == JointKind::kRotary ? "joint that turns" : "joint that slides");
    x += 192.0;
  }
  if (has_workspace) {
    text += fmt::format("<rect class=\"forbidden\" x=\"24\" y=\"{:.1f}\" width=\"26\" height=\"13\"/>\n",
                        y + 45.0) +
            text_at(58, y + 56.0, "", "outside [workspace]");
  }
  return text;
}

/// Returns a bar of a round length with the length as text.
std::string scale_bar(double px_per_m, double y) {
  const double length_m = round_length(60.0 / px_per_m);
  const double end = 6.0 + length_m * px_per_m;
  return fmt::format("<path class=\"bar\" d=\"M6 {0:.1f}v6H{1:.1f}v-6\"/>\n", y - 6.0, end) +
         text_at(end + 6.0, y, "", fmt::format("{:.3g} m", length_m));
}

std::string svg_of(const Profile& profile, double width, double height, const char* lines,
                   const std::string& body) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
      "{1:.0f}\" role=\"img\">\n<title>{2}: the arm and the reach of its tool centre point</title>\n"
      "<style>{3}{4}</style>\n<rect class=\"back\" width=\"100%\" height=\"100%\" rx=\"6\"/>\n{5}</svg>\n",
      width, height, profile.name, kStyle, lines, body);
}

}  // namespace

std::string arm_picture(const Profile& profile, const Joints& q, PictureSize size) {
  const ArmModel& arm = profile.arm;
  const Workspace space = workspace_of(arm);
  const ArmLine line = arm_line(arm.kinematics, q);
  const DrawnPlane side = side_plane(space, line);
  const DrawnPlane above{{}, {1, 0, 0}, {0, 1, 0}};
  const auto joint1_q = space.about_axis ? std::optional(q[0]) : std::nullopt;
  std::array<Panel, 2> panels{Panel(side, reach_region(arm, side, joint1_q), line),
                              Panel(above, reach_region(arm, above, std::nullopt), line)};
  const bool is_full = size == PictureSize::kFull;
  const Layout& layout = is_full ? kFull : kThumbnail;
  double px_per_m = 1e9;
  for (const Panel& panel : panels) {
    px_per_m = std::min({px_per_m, layout.panel_width / std::max(panel.width_m(), 1e-3),
                         layout.panel_height / std::max(panel.height_m(), 1e-3)});
  }
  std::string body;
  double bottom = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double spare = layout.panel_width - panels[k].width_m() * px_per_m;
    panels[k].place(layout.lefts[k] + 0.5 * spare, layout.top, px_per_m);
    bottom = std::max(bottom, panels[k].bottom());
    if (is_full) body += panels[k].grid();
    body += panels[k].reach() + panels[k].forbidden(arm.workspace);
    if (k == 0) body += panels[k].foot(layout.foot);
    body += panels[k].arm(layout.joint_radius);
  }
  if (!is_full) {
    body += scale_bar(px_per_m, bottom + 18.0);
    return svg_of(profile, layout.width, bottom + 26.0, kThinLines, body);
  }
  const bool has_workspace = arm.workspace.count > 0;
  body += text_at(24, 32, "title", profile.name);
  body += axes_of(panels[0], "from the side", space.about_axis ? "r from axis 1, m" : "x, m", "z, m");
  body += axes_of(panels[1], "from above", "x, m", "y, m") + legend(line, has_workspace, bottom + 76.0);
  return svg_of(profile, layout.width, bottom + (has_workspace ? 150.0 : 122.0), kFullLines, body);
}

}  // namespace corbot::cli
