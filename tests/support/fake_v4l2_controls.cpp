// The controls of tests/support/fake_v4l2.h.
#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tests/support/fake_v4l2.h"

namespace posed::test {

namespace {

FakeControl* find_control(FakeCamera& camera, std::uint32_t id) {
  const auto found =
      std::find_if(camera.controls.begin(), camera.controls.end(), [&](const FakeControl& control) { return control.id == id; });
  return found == camera.controls.end() ? nullptr : &*found;
}

/// As the kernel's own control framework: out of range is ERANGE, what cannot be written EACCES.
int write_control(FakeControl* control, std::int64_t value) {
  if (control == nullptr) {
    return -EINVAL;
  }
  if ((control->flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) {
    return -EACCES;
  }
  if (value < control->minimum || value > control->maximum) {
    return -ERANGE;
  }
  control->value = value;
  return 0;
}

}  // namespace

/// The first whose id is larger, in order of ids.
int FakeKernel::query_control(const FakeCamera& camera, v4l2_query_ext_ctrl& query) const {
  const std::uint32_t after = query.id & ~(V4L2_CTRL_FLAG_NEXT_CTRL | V4L2_CTRL_FLAG_NEXT_COMPOUND);
  const FakeControl* next = nullptr;
  for (const FakeControl& control : camera.controls) {
    if (control.id > after && (next == nullptr || control.id < next->id)) {
      next = &control;
    }
  }
  if (next == nullptr) {
    return -EINVAL;
  }
  query = {};
  query.id = next->id;
  query.type = next->type;
  query.flags = next->flags;
  query.minimum = next->minimum;
  query.maximum = next->maximum;
  query.step = next->step;
  std::memcpy(query.name, next->name.data(), std::min(next->name.size(), sizeof query.name - 1));
  return 0;
}

int FakeKernel::control(File& file, unsigned long request, void* argument) {
  FakeCamera& camera = file.node->camera;
  switch (request) {
    case VIDIOC_QUERY_EXT_CTRL:
      return camera.extended_controls ? query_control(camera, *static_cast<v4l2_query_ext_ctrl*>(argument)) : -ENOTTY;
    case VIDIOC_QUERYCTRL: {
      auto& old = *static_cast<v4l2_queryctrl*>(argument);
      v4l2_query_ext_ctrl query{};
      query.id = old.id;
      const int done = query_control(camera, query);
      if (done == 0) {
        old = {};
        old.id = query.id;
        old.type = query.type;
        old.flags = query.flags;
        old.minimum = static_cast<std::int32_t>(query.minimum);
        old.maximum = static_cast<std::int32_t>(query.maximum);
        old.step = static_cast<std::int32_t>(query.step);
        std::memcpy(old.name, query.name, sizeof old.name - 1);
      }
      return done;
    }
    case VIDIOC_QUERYMENU: {
      auto& menu = *static_cast<v4l2_querymenu*>(argument);
      const FakeControl* found = find_control(camera, menu.id);
      const auto entry = found == nullptr ? 0 : static_cast<std::size_t>(menu.index) - static_cast<std::size_t>(found->minimum);
      if (found == nullptr || entry >= found->menu.size() || found->menu[entry].empty()) {
        return -EINVAL;
      }
      if (found->type == V4L2_CTRL_TYPE_INTEGER_MENU) {
        menu.value = std::stoll(found->menu[entry]);
      } else {
        std::memset(menu.name, 0, sizeof menu.name);
        std::memcpy(menu.name, found->menu[entry].data(), std::min(found->menu[entry].size(), sizeof menu.name - 1));
      }
      return 0;
    }
    case VIDIOC_S_CTRL: {
      const auto& set = *static_cast<v4l2_control*>(argument);
      return write_control(find_control(camera, set.id), set.value);
    }
    case VIDIOC_S_EXT_CTRLS: {
      const auto& set = *static_cast<v4l2_ext_controls*>(argument);
      return set.count == 1 ? write_control(find_control(camera, set.controls[0].id), set.controls[0].value64) : -EINVAL;
    }
    default: return -ENOTTY;
  }
}

}  // namespace posed::test
