// SPDX-License-Identifier: Apache-2.0
// A setting and its file agree wherever the servant is killed: the test's second object is the next servant.
#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "config/load_profile.h"
#include "robot/further_workspace.h"
#include "support/paths.h"

namespace corbot {
namespace {

namespace fs = std::filesystem;

class KeptSettingOnDisk : public ::testing::Test {
 protected:
  KeptSettingOnDisk() : arm_(load_profile(fs::path(CORBOT_PROFILES) / "lynx5.toml").arm), now_(arm_, "they") {
    std::string path = CORBOT_SCRATCH_DIR "/kept-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    EXPECT_EQ(now_.keep_in(store()), "");
  }
  ~KeptSettingOnDisk() override { fs::remove_all(directory_); }

  [[nodiscard]] FurtherShapesStore store() const { return {directory_, "lynx5", "ssc32"}; }
  [[nodiscard]] static PlacedShapes floor_at(double offset_m) {
    PlacedShapes placed;
    placed.further.shapes[0] = plane_shape({{0, 0, 1}, offset_m}, 1);
    placed.further.shapes[0].name = {"low"};
    placed.further.count = 1;
    return placed;
  }
  /// Returns the floor's offset after a restart; 0: none. Nothing if it is not known.
  [[nodiscard]] std::optional<double> after_restart() const {
    FurtherWorkspace next(arm_, "they");
    if (!next.keep_in(store()).empty()) return std::nullopt;
    const auto shapes = next.shapes();
    return shapes ? shapes->shapes[0].faces[0].offset_m : 0.0;
  }
  void set(const std::optional<PlacedShapes>& wanted) {
    now_.change(wanted, [&] { now_.take(wanted); });
  }
  void refuse(const std::optional<PlacedShapes>& wanted) {
    EXPECT_THROW(now_.change(wanted, [] { throw not_ready("motions"); }), CallError);
  }

  const ArmModel arm_;
  fs::path directory_;
  FurtherWorkspace now_;
};

TEST_F(KeptSettingOnDisk, IsSavedBeforeItIsInForce) {
  const std::optional<PlacedShapes> floor = floor_at(-0.5);
  now_.change(floor, [&] {
    EXPECT_EQ(after_restart(), -0.5);
    EXPECT_FALSE(now_.shapes());
    now_.take(floor);
  });
  now_.change(std::nullopt, [&] {
    EXPECT_EQ(after_restart(), 0.0);
    EXPECT_TRUE(now_.shapes());
    now_.take(std::nullopt);
  });
}

TEST_F(KeptSettingOnDisk, ThatIsRefusedIsAsBeforeAfterARestart) {
  set(floor_at(-0.5));
  refuse(floor_at(-1.0));
  EXPECT_EQ(after_restart(), -0.5);
  refuse(std::nullopt);
  EXPECT_EQ(after_restart(), -0.5);
}

TEST_F(KeptSettingOnDisk, ThatIsUnknownAndRefusedIsUnknownAfterARestart) {
  set(floor_at(-0.5));
  for (const auto& entry : fs::directory_iterator(directory_))
    std::ofstream(entry.path(), std::ios::app) << "?";
  EXPECT_NE(now_.keep_in(store()), "");
  refuse(std::nullopt);
  EXPECT_FALSE(now_.is_known());
  EXPECT_FALSE(after_restart()) << "no joint may move then";
  const std::optional<std::string> before = store().text();
  refuse(floor_at(-1.0));
  EXPECT_FALSE(after_restart());
  EXPECT_EQ(store().text(), before) << "its owner may mend the file";
  set(std::nullopt);
  EXPECT_EQ(after_restart(), 0.0);
}

TEST_F(KeptSettingOnDisk, ThatCannotBeRestoredIsUnknown) {
  set(floor_at(-0.5));
  EXPECT_THROW(now_.change(std::nullopt,
                           [&] {
                             fs::remove_all(directory_);
                             std::ofstream(directory_) << "no directory";
                             throw not_ready("motions");
                           }),
               CallError);
  EXPECT_FALSE(now_.is_known());
}

/// A store whose next save fails when the new file is in its place: its directory cannot be synchronised.
struct FailingStore {
  using Value = FurtherShapesStore::Value;
  FurtherShapesStore store;
  bool* fails;

  [[nodiscard]] std::optional<Value> load(const ArmModel& arm) const { return store.load(arm); }
  void save(const std::optional<Value>& value, const ArmModel& arm) const {
    store.save(value, arm);
    if (std::exchange(*fails, false)) throw std::system_error(EIO, std::generic_category(), "directory");
  }
  [[nodiscard]] std::optional<std::string> text() const { return store.text(); }
  void put(const std::optional<std::string>& text) const { store.put(text); }
};

TEST_F(KeptSettingOnDisk, WhoseSaveFailsLateIsAsBeforeAfterARestart) {
  bool fails = false;
  KeptSetting<FailingStore> now(arm_, "they");
  ASSERT_EQ(now.keep_in({store(), &fails}), "");
  const std::optional<PlacedShapes> floor = floor_at(-0.5);
  now.change(floor, [&] { now.take(floor); });
  for (const auto& wanted : {std::optional(floor_at(-1.0)), std::optional<PlacedShapes>()}) {
    fails = true;
    EXPECT_THROW(now.change(wanted, [] { FAIL() << "nothing is saved"; }), CallError);
    EXPECT_EQ(after_restart(), -0.5);
    EXPECT_TRUE(now.is_known());
  }
}

}  // namespace
}  // namespace corbot
