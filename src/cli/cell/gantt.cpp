// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/gantt.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace corbot::cli {
namespace {

using cell::Activity;

// Units of the picture, which is 1200 wide. A lane has from top to bottom: name, numbers of pieces, bars,
// zone.
constexpr double kTitleHeight = 50;
constexpr double kLaneHeight = 176;
constexpr double kNameLine = 26;
constexpr double kPieceLine = 64;
constexpr double kBarTop = 74;
constexpr double kBarHeight = 60;
constexpr double kZoneTop = 142;
constexpr double kZoneHeight = 12;
constexpr double kAxisHeight = 86;
constexpr double kLegendRow = 42;
constexpr double kLeastBar = 0.25;     // narrower bars are omitted: they are not visible
constexpr double kLeastLook = 3;       // a camera look is short, and is drawn wider
constexpr double kLetter = 19;         // widest letter of a small picture's text
constexpr double kLetterOfLarge = 11;  // widest letter of a large picture's text
constexpr double kLeastTick = 100;     // between two ticks

/// A bar's appearance. Height, pattern and colour differ, so that each alone distinguishes the activities.
struct Style {
  Activity activity;
  const char* name;
  const char* label;
  double top;  ///< distance below kBarTop
  double height;
};
constexpr std::array<Style, 4> kStyles{{
    {Activity::kMoving, "move", "moves or grips", 0, kBarHeight},
    {Activity::kWaitingForZone, "zone", "waits for the zone", 15, 30},
    {Activity::kWaitingForPiece, "piece", "waits for a piece or a slot", 24, 12},
    {Activity::kLooking, "look", "looks", -6, kBarHeight + 12},
}};

// Colours of Okabe and Ito, which people without full colour vision can distinguish.
constexpr const char* kHead = R"svg(<style>
text{font:18px system-ui,"Segoe UI",Arial,sans-serif;fill:#222}
.title{font-size:22px;font-weight:600} .piece,.tick{text-anchor:middle;font-variant-numeric:tabular-nums}
.ground{fill:#fff} .axis{stroke:#222;stroke-width:1.5} .grid{stroke:#ddd}
.move{fill:#0072b2} .look{fill:#cc79a7;stroke:#7a3f60;stroke-width:.6}
.zone{fill:url(#zone);stroke:#d55e00} .piece-bar{fill:url(#dots);stroke:#777}
.inside{fill:#009e73} .held,.placed{stroke:#222;fill:none} .held{stroke-width:1.5;stroke-dasharray:4 4}
.placed{stroke-width:2.5} .lines{stroke:#d55e00;stroke-width:4} .under{fill:#fff3e6}
.dot{fill:#555} .dot-under{fill:#e4e4e4}
@media (max-width:700px){text{font-size:32px} .title{font-size:36px} .large{display:none}}
@media (prefers-color-scheme:dark){text{fill:#eee} .ground{fill:#16181c} .axis{stroke:#eee}
.grid{stroke:#383c42} .move{fill:#56b4e9} .held,.placed{stroke:#fff}
.under{fill:#3a2410} .dot{fill:#ccc} .dot-under{fill:#33373d}
.look{stroke:#fff}}
</style>
<defs><pattern id="zone" width="8" height="8" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">
<rect class="under" width="8" height="8"/><path class="lines" d="M2 0v8"/></pattern>
<pattern id="dots" width="6" height="6" patternUnits="userSpaceOnUse">
<rect class="dot-under" width="6" height="6"/><circle class="dot" cx="3" cy="3" r="1.3"/></pattern></defs>
)svg";

const char* bar_class(const Style& style) {
  return style.activity == Activity::kWaitingForPiece ? "piece-bar" : style.name;
}

class Chart {
 public:
  Chart(const WorkHistory& history, const Period& period) : history_(history), period_(period) {}

  std::string draw() {
    const double lanes_end = kTitleHeight + kLaneHeight * static_cast<double>(history_.robots.size());
    const double height = lanes_end + kAxisHeight + 4 * kLegendRow;
    const auto placed = std::count_if(history_.milestones.begin(), history_.milestones.end(),
                                      [](const PieceMilestone& what) { return what.is_last; });
    const std::string title =
        fmt::format("{} piece{} in {:.1f} s", placed, placed == 1 ? "" : "s", period_.duration_s());
    svg_ = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1200 {:.0f}\" role=\"img\" "
        "aria-labelledby=\"title desc\">\n<title id=\"title\">What each robot did: {}</title>\n"
        "<desc id=\"desc\">{}</desc>\n",
        height, title, description());
    svg_ += kHead;
    svg_ += fmt::format("<rect class=\"ground\" width=\"1200\" height=\"{:.0f}\"/>\n", height);
    text("title", kGanttLeft, 36, title);
    axis(lanes_end);
    double top = kTitleHeight;
    for (const std::string& robot : history_.robots) {
      lane(robot, top);
      top += kLaneHeight;
    }
    legend(lanes_end + kAxisHeight);
    return svg_ + "</svg>\n";
  }

 private:
  [[nodiscard]] double x(double time_s) const {
    return kGanttLeft + (kGanttRight - kGanttLeft) * (time_s - period_.begin_s) / period_.duration_s();
  }
  void text(const char* kind, double at_x, double at_y, const std::string& what) {
    svg_ += fmt::format("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", kind, at_x, at_y, what);
  }
  void path(const std::string& kind, const std::string& d) {
    if (!d.empty()) svg_ += fmt::format("<path class=\"{}\" d=\"{}\"/>\n", kind, d);
  }
  static std::string box(double left, double top, double width, double height) {
    return fmt::format("M{:.2f} {:.0f}h{:.2f}v{:.0f}h-{:.2f}z", left, top, width, height, width);
  }

  /// Returns a description for readers who use a screen reader.
  [[nodiscard]] std::string description() const {
    std::string text = "A lane for each robot; time in seconds from the first piece reserved.";
    for (const std::string& robot : history_.robots) {
      text += fmt::format(" {}:", robot);
      for (const Style& style : kStyles) {
        double sum_s = 0;
        for (const Span& span : spans_of(history_, robot, period_))
          sum_s += span.activity == style.activity ? span.period.duration_s() : 0;
        text += fmt::format(" {} {:.1f} s{}", style.label, sum_s, &style == &kStyles.back() ? "." : ",");
      }
    }
    return text;
  }

  void axis(double bottom) {
    const double duration_s = period_.duration_s();
    double step_s = 1;
    for (int i = 0; step_s * (kGanttRight - kGanttLeft) / duration_s < kLeastTick; ++i)
      step_s *= i % 3 == 1 ? 2.5 : 2;  // 1, 2, 5, 10
    std::string grid;
    for (int i = 0; i * step_s <= duration_s; ++i) {
      const double at_s = i * step_s;
      const double at = x(period_.begin_s + at_s);
      grid += fmt::format("M{:.2f} {:.0f}V{:.0f}", at, kTitleHeight, bottom + 8);
      text("tick", at, bottom + 40, fmt::format("{:g}", at_s));
    }
    path("grid", grid);
    path("axis", fmt::format("M{:.0f} {:.0f}H{:.0f}", kGanttLeft, bottom, kGanttRight));
    text("tick", (kGanttLeft + kGanttRight) / 2, bottom + 76, "time in seconds");
  }

  void lane(const std::string& robot, double top) {
    const std::vector<Span> spans = spans_of(history_, robot, period_);
    text("name", kGanttLeft, top + kNameLine, robot);
    for (const Style& style : kStyles) bars(style, spans, top + kBarTop + style.top);
    std::string inside;
    for (const Period& period : merged(spans, [](const Span& span) { return !span.zone.empty(); }))
      inside += box(x(period.begin_s), top + kZoneTop, x(period.end_s) - x(period.begin_s), kZoneHeight);
    path("inside", inside);
    hairlines(robot, top);
    numbers(spans, top + kPieceLine);
  }

  /// Merges consecutive spans to one bar.
  template <class F>
  static std::vector<Period> merged(const std::vector<Span>& spans, F&& is_wanted) {
    std::vector<Period> periods;
    for (const Span& span : spans) {
      if (!is_wanted(span)) continue;
      if (!periods.empty() && periods.back().end_s == span.period.begin_s) {
        periods.back().end_s = span.period.end_s;
      } else {
        periods.push_back(span.period);
      }
    }
    return periods;
  }

  void bars(const Style& style, const std::vector<Span>& spans, double top) {
    std::string d;
    double free_from = 0;
    for (const Period& bar :
         merged(spans, [&](const Span& span) { return span.activity == style.activity; })) {
      double width = x(bar.end_s) - x(bar.begin_s);
      if (style.activity == Activity::kLooking) width = std::max(width, kLeastLook);
      const double left = std::min(x(bar.begin_s), kGanttRight - width);
      if (width < kLeastBar || left < free_from) continue;
      free_from = left + kLeastBar;
      d += box(left, top, width, style.height);
    }
    path(bar_class(style), d);
  }

  void hairlines(const std::string& robot, double top) {
    for (const Milestone milestone : {Milestone::kHeld, Milestone::kPlaced}) {
      std::string d;
      double last = 0;
      for (const PieceMilestone& what : history_.milestones) {
        if (what.robot != robot || what.milestone != milestone || x(what.time_s) < last + 1) continue;
        last = x(what.time_s);
        d += fmt::format("M{:.2f} {:.0f}V{:.0f}", last, top + kPieceLine + 4, top + kZoneTop + kZoneHeight);
      }
      path(milestone == Milestone::kHeld ? "held" : "placed", d);
    }
  }

  /// Writes the number of each piece over its work. Without enough space it omits the number in a small
  /// picture, or everywhere.
  void numbers(const std::vector<Span>& spans, double y) {
    double small_free_from = 0;
    double large_free_from = 0;
    for (std::size_t i = 0; i < spans.size();) {
      const std::size_t first = i;
      while (i < spans.size() && spans[i].piece == spans[first].piece) ++i;
      if (spans[first].piece == 0) continue;
      const std::string number = fmt::format("{}", spans[first].piece);
      const double middle = (x(spans[first].period.begin_s) + x(spans[i - 1].period.end_s)) / 2;
      const double half = kLetter * static_cast<double>(number.size() + 1) / 2;
      const double half_of_large = kLetterOfLarge * static_cast<double>(number.size() + 1) / 2;
      const bool is_in_small = middle - half >= small_free_from;
      if (middle - half_of_large < large_free_from) continue;
      large_free_from = middle + half_of_large;
      if (is_in_small) small_free_from = middle + half;
      text(is_in_small ? "piece" : "piece large", middle, y, number);
    }
  }

  void legend(double top) {
    int entry = 0;
    const auto next = [&](const std::string& label, auto&& draw_at) {
      const int row = entry / 2;
      const double left = kGanttLeft + (entry % 2) * 580;
      const double y = top + kLegendRow * row;
      ++entry;
      draw_at(left, y);
      text("entry", left + 60, y + 28, label);
    };
    for (const Style& style : kStyles) {
      const double height = style.height * 0.45;
      next(style.label, [&](double left, double y) {
        const bool is_look = style.activity == Activity::kLooking;
        path(bar_class(style), box(left + (is_look ? 22 : 0), y + 20 - height / 2, is_look ? 5 : 48, height));
      });
    }
    next("is in the zone",
         [&](double left, double y) { path("inside", box(left, y + 14, 48, kZoneHeight)); });
    next("piece held",
         [&](double left, double y) { path("held", fmt::format("M{} {}v32", left + 24, y + 4)); });
    next("piece placed",
         [&](double left, double y) { path("placed", fmt::format("M{} {}v32", left + 24, y + 4)); });
    next("number of the piece", [&](double left, double y) { text("piece", left + 24, y + 28, "7"); });
  }

  const WorkHistory& history_;
  const Period period_;
  std::string svg_;
};

}  // namespace

std::string gantt_svg(const WorkHistory& history) {
  const auto period = period_of(history);
  if (!period || history.activities.empty()) return "";
  return Chart(history, *period).draw();
}

}  // namespace corbot::cli
