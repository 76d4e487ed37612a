#include "config/config_reference.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <set>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config_loader.h"
#include "config/config_schema.h"

namespace posed {
namespace {

const std::filesystem::path kRoot = POSED_SOURCE_DIR;

constexpr const char* kHowToRegenerate =
    "config/config_schema.cpp has changed; regenerate with\n"
    "  cmake --build build/dev --target posed_config_reference && build/dev/config/posed_config_reference .";

std::string contents(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<SchemaKey*> all_keys(Schema& schema) {
  std::vector<SchemaKey*> keys;
  for (SchemaSection& section : schema) {
    for (SchemaKey& key : section.keys) {
      keys.push_back(&key);
    }
  }
  return keys;
}

TEST(ConfigReference, PageInTheTreeIsUpToDate) {
  EXPECT_EQ(contents(kRoot / "docs" / "configuration.md"), configuration_reference()) << kHowToRegenerate;
}

TEST(ConfigReference, ExampleInTheTreeIsUpToDate) {
  EXPECT_EQ(contents(kRoot / "config" / "posed.toml"), example_configuration()) << kHowToRegenerate;
}

TEST(ConfigReference, ExampleIsTheDefaults) {
  const Result<Config> example = load_config(kRoot / "config" / "posed.toml");
  ASSERT_TRUE(example) << example.error().message;
  const Result<Config> defaults = default_config();
  ASSERT_TRUE(defaults) << defaults.error().message;
  EXPECT_EQ(to_toml(*example), to_toml(*defaults));
  EXPECT_EQ(to_toml(example->intrinsics), to_toml(defaults->intrinsics));
}

TEST(ConfigSchema, EveryKeyIsNamedOnceByItsSectionAndDescribed) {
  Config config;
  std::set<std::string> names;
  for (const SchemaSection& section : config_schema(config)) {
    EXPECT_FALSE(section.description.empty()) << section.name;
    for (const SchemaKey& key : section.keys) {
      EXPECT_TRUE(names.insert(key.name).second) << key.name;
      EXPECT_EQ(key.name.substr(0, key.name.rfind('.')), section.name);
      EXPECT_TRUE(key.description.ends_with(".")) << key.name;
      EXPECT_FALSE(key.required) << key.name << ": an empty file must be valid";
    }
  }
  EXPECT_GT(names.size(), 40U);
}

/// A value that `field` allows. Leaves texts alone, whose rules cannot be enumerated.
void randomise(const Field& field, std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto pick = [&](auto low, auto high) { return std::uniform_int_distribution<std::int64_t>(low, high)(random); };
  if (const auto* f = std::get_if<BoolField>(&field)) {
    *f->value = pick(0, 1) == 1;
  } else if (const auto* i = std::get_if<IntegerField>(&field)) {
    const std::int64_t value = pick(i->minimum, i->maximum);
    std::visit([&](auto* target) { *target = static_cast<std::remove_pointer_t<decltype(target)>>(value); }, i->value);
  } else if (const auto* r = std::get_if<RealField>(&field)) {
    *r->value = uniform(r->minimum, r->maximum);
  } else if (const auto* rs = std::get_if<RealListField>(&field)) {
    for (double* value : rs->values) {
      *value = uniform(rs->minimum, rs->maximum);
    }
  } else if (const auto* is = std::get_if<IntegerListField>(&field)) {
    is->value->resize(static_cast<std::size_t>(pick(0, 8)));
    for (int& value : *is->value) {
      value = static_cast<int>(pick(is->minimum, is->maximum));
    }
  } else if (const auto* ts = std::get_if<TextListField>(&field)) {
    std::shuffle(ts->value->begin(), ts->value->end(), random);
  } else if (const auto* c = std::get_if<ChoiceField>(&field)) {
    c->set(c->names[static_cast<std::size_t>(pick(0, static_cast<std::int64_t>(c->names.size()) - 1))]);
  } else if (const auto* p = std::get_if<PoseField>(&field)) {
    const Eigen::Quaterniond q(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(0.1, 1));
    *p->value = Se3(q, {uniform(-1e7, 1e7), uniform(-10, 10), uniform(-1e-7, 1e-7)});
  }
}

/// Makes the values agree with the rules that tie keys together.
void satisfy_rules(Config& c) {
  c.source.replay.sequence = "/recordings/\"quoted\" \\ \t\xC3\xA9";
  c.source.synthetic.people = c.source.synthetic.world == SyntheticWorldKind::Room ? c.source.synthetic.people : 0;
  c.source.v4l2.device = "/dev/video0";
  c.source.depth.node.device = "/dev/video2";
  c.source.pacing =
      c.source.kind == SourceKind::Synthetic || c.source.kind == SourceKind::Replay ? c.source.pacing : Pacing::Realtime;
  c.gpio.status_line = -1;
  c.gpio.trigger_line = -1;
  c.map.file = "/maps/hall";
  c.detector.enabled = false;  // the models would come back as paths
  c.tracker.fast_threshold_minimum = std::min(c.tracker.fast_threshold_minimum, c.tracker.fast_threshold);
  c.tracker.min_inliers = std::min(c.tracker.min_inliers, c.tracker.features - 1);
  c.mapper.local_keyframes = std::min(c.mapper.local_keyframes, c.mapper.max_keyframes);
  c.mapper.recovery_keyframes = std::min(c.mapper.recovery_keyframes, c.mapper.max_keyframes);
  c.pipeline.frame_slots = std::max(c.pipeline.frame_slots, c.pipeline.frame_queue + 2);
  c.tracker.pyramid_levels = std::min(c.tracker.pyramid_levels, 3);
  for (ThreadConfig* thread :
       {&c.pipeline.capture, &c.pipeline.tracker, &c.pipeline.mapper, &c.pipeline.detector, &c.pipeline.publisher}) {
    thread->priority = std::max(thread->priority, 1);
    if (thread->policy == ThreadPolicyName::Deadline && thread != &c.pipeline.detector) {
      thread->policy = ThreadPolicyName::Fifo;
    }
  }
}

TEST(ConfigRoundTrip, RandomValuesReadBackTheSame) {
  std::mt19937_64 random(20);
  for (int i = 0; i < 200; ++i) {
    Config config;
    Schema schema = config_schema(config);
    for (const SchemaKey* key : all_keys(schema)) {
      randomise(key->field, random);
    }
    satisfy_rules(config);
    config.camera.calibration = (kRoot / "config" / "cameras" / "synthetic_vga.toml").string();
    const std::string text = to_toml(config);
    const Result<Config> read = parse_config(text, "posed.toml");
    ASSERT_TRUE(read) << read.error().message << "\n" << text;

    // Normalising a quaternion again may change its last digit: compare poses by value and everything else by text.
    Config same = *read;
    EXPECT_TRUE(same.camera.T_base_camera.rotation().isApprox(config.camera.T_base_camera.rotation(), 1e-15));
    EXPECT_TRUE(same.source.depth.T_camera_depth.rotation().isApprox(config.source.depth.T_camera_depth.rotation(), 1e-15));
    EXPECT_TRUE(same.camera.T_map_start.rotation().isApprox(config.camera.T_map_start.rotation(), 1e-15));
    EXPECT_EQ(same.camera.T_base_camera.translation(), config.camera.T_base_camera.translation());
    EXPECT_EQ(same.source.depth.T_camera_depth.translation(), config.source.depth.T_camera_depth.translation());
    same.camera = config.camera;
    same.source.depth.T_camera_depth = config.source.depth.T_camera_depth;
    EXPECT_EQ(to_toml(same), text);
  }
}

/// Every key alone, one step outside of its limits, is refused and the message says so.
TEST(ConfigRoundTrip, ValuesJustOutsideOfTheLimitsAreRefused) {
  Config config;
  Schema schema = config_schema(config);
  int checked = 0;
  for (const SchemaKey* key : all_keys(schema)) {
    std::vector<std::string> outside;
    if (const auto* i = std::get_if<IntegerField>(&key->field)) {
      outside.push_back(fmt::format("{}", i->minimum - 1));
      if (i->maximum < std::numeric_limits<std::int64_t>::max()) {
        outside.push_back(fmt::format("{}", i->maximum + 1));
      }
    } else if (const auto* r = std::get_if<RealField>(&key->field)) {
      outside.push_back(real_text(std::nextafter(r->minimum, -1e9)));
      outside.push_back(real_text(std::nextafter(r->maximum, 1e9)));
    }
    for (const std::string& value : outside) {
      const Result<Config> read = parse_config(key->name + " = " + value, "posed.toml");
      ASSERT_FALSE(read) << key->name << " = " << value;
      EXPECT_EQ(read.error().message, fmt::format("posed.toml:1:{}: {}: {}: out of range, allowed {}", key->name.size() + 4,
                                                  key->name, value, allowed_text(key->field)));
      ++checked;
    }
  }
  EXPECT_GT(checked, 50);
}

TEST(ConfigReference, PageHasEveryKey) {
  Config config;
  const std::string page = configuration_reference();
  for (const SchemaSection& section : config_schema(config)) {
    EXPECT_THAT(page, testing::HasSubstr("## `[" + section.name + "]`"));
    for (const SchemaKey& key : section.keys) {
      EXPECT_THAT(page, testing::HasSubstr("| `" + key.name.substr(section.name.size() + 1) + "` | " + type_text(key.field) +
                                           " | `" + value_text(key.field) + "` |"));
    }
  }
}

}  // namespace
}  // namespace posed
