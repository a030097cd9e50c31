// SPDX-License-Identifier: Apache-2.0
#include "cell/scene_record.h"

#include <gmock/gmock.h>

#include <sstream>

#include "client/failure.h"

namespace corbot::cell {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

const SceneCast kCast{.arms = {{"robot1", {0.03, 0.02}}}, .kinds = {"red", "blue"}};

SceneSample sample_at(double time_s, double x_m) {
  return {
      .time_s = time_s,
      .arms = {{.points_m = {{0, 0, 0}, {0, 0, 0.1}, {x_m, 0, 0.1}}, .opening_m = 0.03, .across_rad = 1.5}},
      .pieces = {{.foot_m = {0.1, 0.2, 0}, .hand = {}}, {.foot_m = {0.3, 0.2, 0}, .hand = {}}}};
}

SceneRecord read(const std::string& text) {
  std::istringstream stream(text);
  return read_scene_record(stream);
}

TEST(SceneRecordText, ReadsBackAsItWasWritten) {
  SceneRecordText text;
  SceneSample second = sample_at(0.05, 0.21234);
  second.pieces[1] = {.foot_m = {0.3, 0.2, 0.05}, .hand = 0};
  SceneSample third = sample_at(0.1, 0.21234);
  third.pieces[1] = {.foot_m = {0.3, 0.25, 0}, .hand = {}, .is_fallen = true};
  third.pieces[0].yaw_rad = -0.7;
  std::string all = text.begin(kCast);
  for (const SceneSample& sample : {sample_at(0, 0.2), second, third}) all += text.add(sample);
  const SceneRecord record = read(all);
  ASSERT_EQ(record.cast.arms.size(), 1u);
  EXPECT_EQ(record.cast.arms[0].name, "robot1");
  EXPECT_EQ(record.cast.arms[0].radii_m, (std::vector{0.03, 0.02}));
  EXPECT_EQ(record.cast.kinds, kCast.kinds);
  ASSERT_EQ(record.samples.size(), 3u);
  EXPECT_EQ(record.samples[0].arms, sample_at(0, 0.2).arms);
  EXPECT_DOUBLE_EQ(record.samples[1].time_s, 0.05);
  EXPECT_DOUBLE_EQ(record.samples[1].arms[0].points_m[2].x(), 0.2123) << "rounded to 0.1 mm";
  EXPECT_EQ(record.samples[1].pieces, second.pieces);
  EXPECT_EQ(record.samples[2].pieces, third.pieces);
  EXPECT_EQ(record.samples[2].arms, record.samples[1].arms) << "what did not change goes on";
  EXPECT_FALSE(record.is_cut);
}

TEST(SceneRecordText, WritesNothingWhileNothingChangesButWhereThatEnds) {
  SceneRecordText text;
  std::string all = text.begin(kCast);
  all += text.add(sample_at(0, 0.2));
  for (int i = 1; i <= 100; ++i) EXPECT_EQ(text.add(sample_at(0.05 * i, 0.20001)), "");
  all += text.add(sample_at(5.05, 0.3));
  EXPECT_EQ(text.add(sample_at(5.1, 0.3)), "");
  all += text.end();
  const SceneRecord record = read(all);
  ASSERT_EQ(record.samples.size(), 4u);
  EXPECT_DOUBLE_EQ(record.samples[1].time_s, 5) << "it did not glide there in five seconds";
  EXPECT_EQ(record.samples[1].arms, record.samples[0].arms);
  EXPECT_DOUBLE_EQ(record.samples[3].time_s, 5.1);
}

TEST(SceneRecordText, EndsBeforeItsLimitAndSaysSo) {
  constexpr std::size_t kLimit_bytes = 4000;
  SceneRecordText text(kLimit_bytes);
  std::string all = text.begin(kCast);
  for (int i = 0; i < 1000; ++i) all += text.add(sample_at(0.05 * i, 0.001 * i));
  all += text.end();
  EXPECT_LE(all.size(), kLimit_bytes);
  EXPECT_GT(all.size(), kLimit_bytes - 300);
  const SceneRecord record = read(all);
  EXPECT_TRUE(record.is_cut);
  EXPECT_GT(record.samples.size(), 10u);
}

TEST(SceneRecordText, ALineThatIsNotWholeIsLeftOut) {
  SceneRecordText text;
  std::string whole = text.begin(kCast);
  whole += text.add(sample_at(0, 0.2));
  const std::string more = text.add(sample_at(0.05, 0.3));
  EXPECT_EQ(read(whole + more.substr(0, more.size() / 2)).samples.size(), 1u);
  EXPECT_EQ(read(whole + more.substr(0, more.size() - 1)).samples.size(), 1u);
  EXPECT_EQ(read(whole + more).samples.size(), 2u);
}

TEST(SceneRecordText, WhatIsNoRecordIsRefused) {
  for (const char* wrong :
       {"", "no record\n", "{}\n", "{\"arms\":[],\"pieces\":[]}\n{\"t\":\"x\"}\n",
        "{\"arms\":[{\"name\":\"r\",\"radii\":[1]}],\"pieces\":[]}\n{\"t\":0}\n",
        "{\"arms\":[],\"pieces\":[\"red\"]}\n{\"t\":0,\"pieces\":[{\"n\":1,\"foot\":[0,0,0]}]}\n"})
    EXPECT_THROW((void)read(wrong), client::Failure) << wrong;
}

}  // namespace
}  // namespace corbot::cell
