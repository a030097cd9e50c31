// SPDX-License-Identifier: Apache-2.0
#include "cell/pictures/cell_animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "cell/pictures/animation_style.h"
#include "cell/pictures/scene_motion.h"
#include "cell/pictures/svg_animate.h"
#include "cell/pictures/view_from_above.h"
#include "corbot/units.h"

namespace corbot::cell {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFactor = 4;  // the animation is so many times faster than the run
constexpr double kBefore_s = 0.5;
constexpr double kAfter_s = 4;
constexpr double kPoster = 0.4;  // share of the time at which a static viewer's picture is
constexpr double kFinest = 0.4;
constexpr double kCoarsest = 12;
constexpr double kLetter = 10.5;  // average width of a letter
constexpr double kRow = 34;       // height of a row of the legend
constexpr double kMark = 11;      // radius of a piece in the legend
constexpr double kShortestPause_s = 0.3;

ViewFromAbove view_of(const CellConfig& cell, const SceneRecord& record) {
  ViewFromAbove view;
  for (const Place& place : cell.places) {
    const Vector2d half = place.half_size_m();
    for (const double x : {-half.x(), half.x()}) {
      for (const double y : {-half.y(), half.y()}) view.take(place.frame.to_world({x, y, 0}), 0.01);
    }
  }
  for (const SceneSample& sample : record.samples) {
    for (std::size_t arm = 0; arm < sample.arms.size(); ++arm) {
      const std::vector<double>& radii_m = record.cast.arms[arm].radii_m;
      for (std::size_t i = 0; i < sample.arms[arm].points_m.size(); ++i)
        view.take(sample.arms[arm].points_m[i], radii_m.empty() ? 0 : radii_m[i == 0 ? 0 : i - 1]);
    }
    for (const RecordedPiece& piece : sample.pieces) view.take(piece.foot_m, 0.01);
  }
  for (const CellRobot& robot : cell.robots) view.take(robot.frame.position_m, 0.06);
  view.fit();
  return view;
}

std::string pair(double a, double b) { return svg_number(a) + (b < -0.05 ? "" : " ") + svg_number(b); }

/// Returns SVG path data for lines. Four values are the two end points of a line.
std::string lines(const std::vector<double>& v) {
  std::string text;
  for (std::size_t i = 0; i + 3 < v.size(); i += 4)
    text += fmt::format("M{}L{}", pair(v[i], v[i + 1]), pair(v[i + 2], v[i + 3]));
  return text;
}

/// A drawing of one record.
class Animation {
 public:
  Animation(const CellConfig& cell, const SceneRecord& record)
      : cell_(cell), record_(record), view_(view_of(cell, record)), motion_(scene_motion(record)) {
    const double first_s = record.samples.empty() ? 0 : record.samples.front().time_s;
    play_ = {std::max(first_s, motion_.begin_s - kBefore_s), motion_.begin_s + motion_.duration_s + kAfter_s,
             kFactor};
    choose_labels();
  }

  [[nodiscard]] std::string text(double tolerance) {
    tolerance_ = tolerance;
    out_.clear();
    begin();
    for (const Place& place : cell_.places) add_place(place);
    for (std::size_t i = 0; i < record_.cast.arms.size(); ++i) add_base(i);
    if (!record_.samples.empty()) {
      for (std::size_t i = 0; i < record_.cast.arms.size(); ++i) add_shadow(i);
      for (std::size_t i = 0; i < record_.cast.kinds.size(); ++i) add_piece(i);
      for (std::size_t i = 0; i < record_.cast.arms.size(); ++i) add_hand(i);
      for (std::size_t i = 0; i < record_.cast.kinds.size(); ++i) add_held(i);
      for (std::size_t i = 0; i < record_.cast.arms.size(); ++i) add_arm(i);
    }
    for (const Place& place : cell_.places) add_name(place);
    add_timeline();
    add_legend();
    return out_ + "</svg>\n";
  }

 private:
  struct Label {
    std::string kind;
    const char* colour;
  };

  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(out_), format, std::forward<Args>(args)...);
  }
  void add_text(double x, double y, const char* attributes, std::string_view text) {
    add("<text x=\"{}\" y=\"{}\" {}>{}</text>\n", svg_number(x), svg_number(y), attributes, svg_text(text));
  }

  /// Gives each kind the nearest colour that no previous kind has.
  void choose_labels() {
    std::vector<LabelColour> left(kLabelColours.begin(), kLabelColours.end());
    for (const Kind& kind : cell_.kinds) {
      if (left.empty()) left.assign(kLabelColours.begin(), kLabelColours.end());
      const auto [from, to] = kind.hue_deg;
      const double hue = std::fmod(from + std::fmod(to - from + 360, 360) / 2, 360);
      const auto away = [hue](const LabelColour& colour) {
        return std::abs(std::remainder(hue - colour.hue_deg, 360));
      };
      const auto nearest =
          std::min_element(left.begin(), left.end(),
                           [&](const LabelColour& a, const LabelColour& b) { return away(a) < away(b); });
      labels_.push_back({kind.name, nearest->text});
      left.erase(nearest);
    }
  }

  [[nodiscard]] double timeline_top() const { return view_.height() + 14; }
  [[nodiscard]] double legend_top() const {
    return timeline_top() + 30 * static_cast<double>(record_.cast.arms.size()) + 34;
  }
  [[nodiscard]] double bottom() const { return legend_top() + 42 + kRow * (1 + label_at().back().y()); }

  [[nodiscard]] std::string summary() const {
    std::string text = record_.is_cut ? "first " : "";
    text += fmt::format("{:.0f} s", motion_.duration_s);
    if (record_.cast.arms.size() > 1)
      text += fmt::format("; {} move {:.0f} % of the time",
                          record_.cast.arms.size() == 2 ? "both arms" : "two arms or more",
                          100 * motion_.both_move_share);
    return text;
  }

  void begin() {
    add("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" "
        "aria-labelledby=\"title desc\">\n",
        svg_number(kViewWidth), svg_number(bottom()));
    add("<title id=\"title\">The cell {} from above, at work</title>\n", svg_text(cell_.name));
    add("<desc id=\"desc\">An animation of a simulated run, {} times faster than real: {} arms bring {} "
        "pieces from place to place. The run: {}.</desc>\n",
        kFactor, record_.cast.arms.size(), record_.cast.kinds.size(), svg_text(summary()));
    add("<style>{}</style>\n", kAnimationStyle);
    add("<rect class=\"panel\" x=\"1\" y=\"1\" width=\"{}\" height=\"{}\" rx=\"14\"/>\n",
        svg_number(kViewWidth - 2), svg_number(bottom() - 2));
    add("<rect class=\"table\" x=\"10\" y=\"10\" width=\"{}\" height=\"{}\" rx=\"8\"/>\n",
        svg_number(kViewWidth - 20), svg_number(view_.height() - 14));
  }

  void add_place(const Place& place) {
    const Vector2d half = place.half_size_m();
    std::string corners;
    for (const Vector2d& sign : {Vector2d(-1, -1), Vector2d(1, -1), Vector2d(1, 1), Vector2d(-1, 1)}) {
      const Vector2d local = half.cwiseProduct(sign);
      const Vector2d corner = view_(place.frame.to_world({local.x(), local.y(), 0}));
      corners += pair(corner.x(), corner.y()) + " ";
    }
    add("<polygon class=\"place{}\" stroke-linejoin=\"round\" points=\"{}\"/>\n", place.slots ? "" : " area",
        corners);
    for (int slot = 0; place.slots && slot < place.slots->count(); ++slot) {
      const Vector2d middle = view_(place.slot_position(slot));
      add("<circle class=\"slot\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>\n", svg_number(middle.x()),
          svg_number(middle.y()), svg_number(view_.length(largest_m() / 2) + 3));
    }
  }

  /// Adds the name above the place, or below it if the place is shared or near the upper edge.
  void add_name(const Place& place) {
    const Vector2d middle = view_(place.frame.position_m);
    double above = middle.y();
    double below = middle.y();
    const Vector2d half = place.half_size_m();
    for (const double x : {-half.x(), half.x()}) {
      for (const double y : {-half.y(), half.y()}) {
        const Vector2d corner = view_(place.frame.to_world({x, y, 0}));
        above = std::min(above, corner.y());
        below = std::max(below, corner.y());
      }
    }
    const std::string text = place.name + (place.is_shared ? ", one arm at a time" : "");
    const bool is_above = !place.is_shared && above - 30 > 10;
    add_text(middle.x(), is_above ? above - 9 : below + 24, "text-anchor=\"middle\" class=\"dim\"", text);
  }

  [[nodiscard]] double largest_m() const {
    double largest = 0;
    for (const Kind& kind : cell_.kinds) largest = std::max(largest, kind.circle_m(kind.width_m));
    return largest;
  }

  void add_base(std::size_t arm) {
    if (record_.samples.empty()) return;
    const Vector2d at = view_(record_.samples.front().arms[arm].points_m.front());
    const bool is_below = at.y() > view_.height() / 2;
    add("<text class=\"f{}\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", arm % kArmColours,
        svg_number(at.x()),
        svg_number(at.y() + (is_below ? 26 : -12) + (is_below ? 1 : -1) * base_radius(arm)),
        svg_text(record_.cast.arms[arm].name));
  }

  [[nodiscard]] double base_radius(std::size_t arm) const {
    const std::vector<double>& radii_m = record_.cast.arms[arm].radii_m;
    return radii_m.empty() ? 0 : view_.length(radii_m.front());
  }

  template <class F>
  [[nodiscard]] Track track(F&& values) const {
    Track track;
    for (const SceneSample& sample : record_.samples) track.push_back({sample.time_s, values(sample)});
    return played(track, play_);
  }

  /// The values of a track in the static picture, and the track's animation.
  struct Moved {
    std::string poster;
    std::string animation;
  };
  [[nodiscard]] Moved moved(std::string_view tag, const Track& track, const Format& format) const {
    const double poster_s = play_.begin_s + kPoster * (play_.end_s - play_.begin_s);
    return {format(values_at(track, poster_s)),
            svg_animation(tag, simplified(track, tolerance_), play_, format)};
  }

  void add_piece(std::size_t number) {
    const Moved place = moved("animateTransform attributeName=\"transform\" type=\"translate\"",
                              track([&](const SceneSample& sample) {
                                const Vector2d at = view_(sample.pieces[number].foot_m);
                                return std::vector<double>{at.x(), at.y()};
                              }),
                              [](const std::vector<double>& v) { return pair(v[0], v[1]); });
    add("<g id=\"p{}\" transform=\"translate({})\">{}", number, place.poster, place.animation);
    const std::string& kind = record_.cast.kinds[number];
    if (is_square(kind)) {
      const Moved turn =
          moved("animateTransform attributeName=\"transform\" type=\"rotate\"", turns_of(number),
                [](const std::vector<double>& v) { return svg_number(v[0]); });
      add("<g transform=\"rotate({})\">{}", turn.poster, turn.animation);
    }
    add_mark(kind, view_.length(width_m(number) / 2));
    add("{}</g>\n", is_square(kind) ? "</g>" : "");
  }
  /// Returns the direction of a square's side in the drawing, in degrees. It changes by less than 45 degrees
  /// from a sample to the next, since a square repeats after 90.
  [[nodiscard]] Track turns_of(std::size_t number) const {
    double last_deg = 0;
    return track([&](const SceneSample& sample) {
      const RecordedPiece& piece = sample.pieces[number];
      const Vector3d along(std::cos(piece.yaw_rad), std::sin(piece.yaw_rad), 0);
      const Vector2d seen = view_(piece.foot_m + along) - view_(piece.foot_m);
      last_deg += std::remainder(to_degrees(std::atan2(seen.y(), seen.x())) - last_deg, 90);
      return std::vector<double>{last_deg};
    });
  }
  [[nodiscard]] bool is_square(const std::string& name) const {
    const Kind* const kind = cell_.kind(name);
    return kind != nullptr && kind->is_square;
  }
  [[nodiscard]] double width_m(std::size_t piece) const {
    const Kind* const kind = cell_.kind(record_.cast.kinds[piece]);
    return kind == nullptr ? largest_m() : kind->width_m;
  }

  /// Adds a piece: body, label in the colour of its kind, and a mark that identifies the kind without
  /// colours.
  void add_mark(const std::string& kind, double radius) {
    const auto label =
        std::find_if(labels_.begin(), labels_.end(), [&](const Label& each) { return each.kind == kind; });
    const char* const colour = label == labels_.end() ? "#888" : label->colour;
    if (is_square(kind))
      add("<rect class=\"piece\" x=\"{0}\" y=\"{0}\" width=\"{1}\" height=\"{1}\"/>"
          "<rect x=\"{2}\" y=\"{2}\" width=\"{3}\" height=\"{3}\" fill=\"{4}\"/>",
          svg_number(-radius), svg_number(2 * radius), svg_number(-0.8 * radius), svg_number(1.6 * radius),
          colour);
    else
      add("<circle class=\"piece\" r=\"{}\"/><circle r=\"{}\" fill=\"{}\"/>", svg_number(radius),
          svg_number(0.8 * radius), colour);
    const double m = 0.4 * radius;
    switch ((label - labels_.begin()) % 4) {
      case 0:
        add("<circle class=\"mark\" r=\"{}\"/>", svg_number(0.75 * m));
        break;
      case 1:
        add("<path class=\"mark\" d=\"M0 {0}L{1} {2}L{3} {2}Z\"/>", svg_number(-m), svg_number(m),
            svg_number(0.8 * m), svg_number(-m));
        break;
      case 2:
        add("<rect class=\"mark\" x=\"{0}\" y=\"{0}\" width=\"{1}\" height=\"{1}\"/>", svg_number(-0.8 * m),
            svg_number(1.6 * m));
        break;
      default:
        add("<path class=\"mark\" d=\"M0 {0}L{1} 0L0 {1}L{0} 0Z\"/>", svg_number(-1.2 * m),
            svg_number(1.2 * m));
    }
  }

  /// Adds a second drawing of the piece above the hand, visible only while a hand holds the piece.
  void add_held(std::size_t number) {
    std::vector<Jump> jumps;
    for (const SceneSample& sample : record_.samples) {
      std::string value = sample.pieces[number].hand ? "1" : "0";
      if (jumps.empty() || jumps.back().value != value) jumps.push_back({sample.time_s, std::move(value)});
    }
    const std::string animation = svg_jumps("opacity", jumps, play_);
    if (animation.empty()) return;
    add("<g opacity=\"0\">{}<use href=\"#p{}\"/></g>\n", animation, number);
  }

  /// Defines the animated line of each link, and adds the shadows below all pieces. The other functions draw
  /// edge, body and joint with the same lines.
  void add_shadow(std::size_t number) {
    const std::vector<double>& radii_m = record_.cast.arms[number].radii_m;
    add("<defs>\n");
    for (std::size_t i = 0; i < radii_m.size(); ++i) {
      const Moved link = moved("animate attributeName=\"d\"", track([&](const SceneSample& sample) {
                                 const std::vector<Vector3d>& points_m = sample.arms[number].points_m;
                                 const Vector2d a = view_(points_m[i]);
                                 const Vector2d b = view_(points_m[i + 1]);
                                 return std::vector<double>{a.x(), a.y(), b.x(), b.y()};
                               }),
                               lines);
      add("<path id=\"a{}l{}\" d=\"{}\">{}</path>\n", number, i, link.poster, link.animation);
    }
    const Moved fingers =
        moved("animate attributeName=\"d\"",
              track([&](const SceneSample& sample) { return fingers_of(sample, number); }), lines);
    add("<path id=\"a{}f\" d=\"{}\">{}</path>\n</defs>\n", number, fingers.poster, fingers.animation);
    add("<g class=\"link\" transform=\"translate(5 8)\">");
    for (std::size_t i = radii_m.size(); i-- > 0;) add_use(number, i, "shade", 2 * view_.length(radii_m[i]));
    add("</g>\n");
  }

  /// Adds the hand, half transparent, so that pieces below it stay visible.
  void add_hand(std::size_t number) {
    if (record_.cast.arms[number].radii_m.empty()) return;
    add("<g class=\"link\" opacity=\".5\">");
    add_link(number, record_.cast.arms[number].radii_m.size() - 1);
    add("</g>\n");
  }

  /// Adds the other links of an arm from the forearm to the base: each link covers the link added before.
  void add_arm(std::size_t number) {
    const std::vector<double>& radii_m = record_.cast.arms[number].radii_m;
    const std::size_t colour = number % kArmColours;
    add("<g class=\"link\">\n<use href=\"#a{0}f\" class=\"e{1}\" stroke-width=\"6\"/>\n", number, colour);
    for (std::size_t i = radii_m.size(); i > 1; --i) add_link(number, i - 2);
    for (std::size_t i = 1; i < radii_m.size(); ++i) {  // a dash of length 0 marks the beginning of the link
      add("<use href=\"#a{}l{}\" class=\"e{}\" stroke-width=\"{}\" stroke-dasharray=\"0 9999\"/>", number, i,
          colour, svg_number(0.8 * view_.length(radii_m[i])));
    }
    add("</g>\n");
  }

  void add_link(std::size_t arm, std::size_t link) {
    const double width = 2 * view_.length(record_.cast.arms[arm].radii_m[link]);
    add_use(arm, link, fmt::format("e{}", arm % kArmColours), width);
    add_use(arm, link, fmt::format("b{}", arm % kArmColours), width - 5);
    add("\n");
  }

  void add_use(std::size_t arm, std::size_t link, const std::string& style, double width) {
    add("<use href=\"#a{}l{}\" class=\"{}\" stroke-width=\"{}\"/>", arm, link, style, svg_number(width));
  }

  /// Returns two short lines, the fingers. Their distance is the opening, or the held piece's width across if
  /// larger.
  [[nodiscard]] std::vector<double> fingers_of(const SceneSample& sample, std::size_t number) const {
    constexpr double kFinger_m = 0.003;
    constexpr double kLength_m = 0.014;
    const RecordedArm& arm = sample.arms[number];
    double opening_m = arm.opening_m;
    for (std::size_t i = 0; i < sample.pieces.size(); ++i) {
      if (sample.pieces[i].hand != number) continue;
      const double turn_rad = sample.pieces[i].yaw_rad - arm.across_rad;
      const double share =
          is_square(record_.cast.kinds[i]) ? std::abs(std::cos(turn_rad)) + std::abs(std::sin(turn_rad)) : 1;
      opening_m = std::max(opening_m, share * width_m(i));
    }
    const Vector3d across(std::cos(arm.across_rad), std::sin(arm.across_rad), 0);
    const Vector3d along(-across.y(), across.x(), 0);
    std::vector<double> values;
    for (const double side : {-1, 1}) {
      const Vector3d middle = arm.points_m.back() + side * (opening_m / 2 + kFinger_m) * across;
      for (const double end : {-1, 1}) {
        const Vector2d at = view_(middle + end * kLength_m / 2 * along);
        values.insert(values.end(), {at.x(), at.y()});
      }
    }
    return values;
  }

  static constexpr double kTimeRight = kViewWidth - 26;
  [[nodiscard]] double time_left() const {
    std::size_t letters = 0;
    for (const SceneCast::Arm& arm : record_.cast.arms) letters = std::max(letters, arm.name.size());
    return 26 + std::min(0.4 * kViewWidth, kLetter * static_cast<double>(letters) + 14);
  }

  /// Adds a bar for each motion of each arm, and a line that moves with the time.
  void add_timeline() {
    const double left = time_left();
    const double width = kTimeRight - left;
    const auto x = [&](double time_s) { return left + width * play_.share(time_s); };
    double y = timeline_top();
    for (std::size_t arm = 0; arm < record_.cast.arms.size(); ++arm, y += 30) {
      add("<text class=\"f{}\" x=\"26\" y=\"{}\">{}</text>\n", arm % kArmColours, svg_number(y + 16),
          svg_text(record_.cast.arms[arm].name));
      add("<rect class=\"track\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"18\" rx=\"4\"/>\n<path "
          "class=\"f{}\" "
          "d=\"",
          svg_number(left), svg_number(y), svg_number(width), arm % kArmColours);
      for (const TimeSpan& span : moving_spans(record_, arm, kShortestPause_s)) {
        const double from = x(span.from_s);
        add("M{} {}h{}v14H{}z", svg_number(from), svg_number(y + 2), svg_number(x(span.to_s) - from),
            svg_number(from));
      }
      add("\"/>\n");
    }
    const double step_s = tick_s(play_.end_s - play_.begin_s);
    const double last_s = play_.end_s - motion_.begin_s - kAfter_s / 2;
    for (int i = 0; i * step_s <= last_s; ++i) {
      const double time_s = i * step_s;
      add_text(x(motion_.begin_s + time_s), y + 16, "text-anchor=\"middle\" class=\"dim\"",
               time_s == 0 ? "0 s" : fmt::format("{:.0f}", time_s));
    }
    add("<path class=\"now\" d=\"M{} {}V{}\"><animateTransform attributeName=\"transform\" "
        "type=\"translate\" "
        "{} values=\"0 0;{} 0\"/></path>\n",
        svg_number(left), svg_number(timeline_top() - 5), svg_number(y - 7), play_.attributes(),
        svg_number(width));
  }

  /// Returns the distance between two ticks, so that there are at most about 8.
  static double tick_s(double span_s) {
    for (const double step_s : {1, 2, 5, 10, 20, 30, 60, 120, 300, 600}) {
      if (span_s / step_s <= 8) return step_s;
    }
    return 1800;
  }

  /// Returns the kinds' positions in the legend: distance from the left, and row. An additional last position
  /// follows the last kind.
  [[nodiscard]] std::vector<Vector2d> label_at() const {
    std::vector<Vector2d> at{{26, 0}};
    for (const Label& label : labels_) {
      const double width = 2 * kMark + 32 + kLetter * static_cast<double>(label.kind.size());
      if (at.back().x() > 26 && at.back().x() + width > kTimeRight - view_.length(0.1) - 92)
        at.back() = {26, at.back().y() + 1};
      at.emplace_back(at.back().x() + width, at.back().y());
    }
    return at;
  }

  void add_legend() {
    double y = legend_top() + 18;
    const std::vector<Vector2d> at = label_at();
    for (std::size_t i = 0; i < labels_.size(); ++i) {
      const double row_y = y + kRow * at[i].y();
      add("<g transform=\"translate({})\">", pair(at[i].x() + kMark, row_y - 7));
      add_mark(labels_[i].kind, kMark);
      add("</g>\n");
      add_text(at[i].x() + 2 * kMark + 8, row_y, "", labels_[i].kind);
    }
    const double bar = view_.length(0.1);
    add("<path class=\"rule\" d=\"M{} {}v10m0-5h{}m0-5v10\"/>\n", svg_number(kTimeRight - bar - 92),
        svg_number(y - 12), svg_number(bar));
    add_text(kTimeRight, y, "text-anchor=\"end\" class=\"dim\"", "100 mm");
    const auto [right, up] = view_.axes();
    y += kRow * (1 + at.back().y());
    add_text(26, y, "", summary());
    add_text(kTimeRight, y, "text-anchor=\"end\" class=\"dim\"",
             fmt::format("{} \xc3\x97 real time, {} right, {} up", kFactor, right, up));
  }

  const CellConfig& cell_;
  const SceneRecord& record_;
  const ViewFromAbove view_;
  const SceneMotion motion_;
  Playback play_;
  std::vector<Label> labels_;
  double tolerance_{kFinest};
  std::string out_;
};

}  // namespace

std::string cell_animation(const CellConfig& cell, const SceneRecord& record) {
  Animation animation(cell, record);
  double tolerance = kFinest;
  std::string text = animation.text(tolerance);
  while (text.size() > kAnimation_bytes && tolerance < kCoarsest) {
    tolerance = std::min(1.5 * tolerance, kCoarsest);
    text = animation.text(tolerance);
  }
  return text;
}

}  // namespace corbot::cell
