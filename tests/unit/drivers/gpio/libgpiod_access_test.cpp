#include "drivers/gpio/libgpiod_access.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <umockdev.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <linux/gpio.h>

#include "drivers/gpio_listing.h"

namespace posed {
namespace {

constexpr std::uint32_t kLines = 8;
constexpr std::uint32_t kTaken = 6;        // by another program
constexpr std::uint32_t kNoInterrupt = 2;  // this one can be read, and tells of nothing

/// A chip below libgpiod: umockdev hands its ioctl calls to this.
class ChipBelow {
 public:
  ChipBelow() : testbed_(umockdev_testbed_new()), handler_(umockdev_ioctl_base_new()) {
    const std::string devices =
        "P: /devices/platform/fake/gpiochip0\nN: gpiochip0\nE: SUBSYSTEM=gpio\nE: DEVNAME=/dev/gpiochip0\nE: MAJOR=254\n"
        "E: MINOR=0\nA: dev=254:0\\n\n\n"
        "P: /devices/platform/fake/gpioline0\nN: gpioline0\nE: SUBSYSTEM=misc\nE: DEVNAME=/dev/gpioline0\nE: MAJOR=10\n"
        "E: MINOR=7\nA: dev=10:7\\n\n\n";
    EXPECT_TRUE(umockdev_testbed_add_from_string(testbed_, devices.c_str(), nullptr));
    g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&ChipBelow::on_ioctl), this);
    EXPECT_TRUE(umockdev_testbed_attach_ioctl(testbed_, "/dev/gpiochip0", handler_, nullptr));
    EXPECT_TRUE(umockdev_testbed_attach_ioctl(testbed_, "/dev/gpioline0", handler_, nullptr));
  }
  ~ChipBelow() {
    umockdev_testbed_detach_ioctl(testbed_, "/dev/gpiochip0", nullptr);
    umockdev_testbed_detach_ioctl(testbed_, "/dev/gpioline0", nullptr);
    g_object_unref(handler_);
    g_object_unref(testbed_);
  }

  /// The level of the line that was asked for last, as posed sees it: the kernel turns active-low lines round.
  std::atomic<int> value{0};
  std::atomic<int> error{0};  ///< of every call on a line; 0: none
  std::atomic<std::uint32_t> flags{0};

  void tell_event() const {
    const gpioevent_data event{123'456'789, GPIOEVENT_EVENT_RISING_EDGE};
    EXPECT_EQ(write(umockdev_testbed_get_dev_fd(testbed_, "/dev/gpioline0"), &event, sizeof(event)),
              static_cast<ssize_t>(sizeof(event)));
  }

 private:
  /// 0 or an errno.
  int answer(unsigned long request, void* argument) {
    switch (request) {
      case GPIO_GET_CHIPINFO_IOCTL: *static_cast<gpiochip_info*>(argument) = {"gpiochip0", "fake", kLines}; return 0;
      case GPIO_GET_LINEINFO_IOCTL: {
        auto* const info = static_cast<gpioline_info*>(argument);
        *info = {info->line_offset, 0, "", ""};
        if (info->line_offset == kTaken) {
          info->flags = GPIOLINE_FLAG_KERNEL;
          std::strcpy(info->name, "SPI_CE0");
          std::strcpy(info->consumer, "spi0 CS0");
        }
        return 0;
      }
      case GPIO_GET_LINEEVENT_IOCTL: {
        auto* const event = static_cast<gpioevent_request*>(argument);
        flags = event->handleflags;
        return event->lineoffset == kNoInterrupt ? ENODEV : open_line(event->lineoffset, event->fd);
      }
      case GPIO_GET_LINEHANDLE_IOCTL: {
        auto* const handle = static_cast<gpiohandle_request*>(argument);
        flags = handle->flags;
        value = handle->default_values[0];
        return open_line(handle->lineoffsets[0], handle->fd);
      }
      case GPIOHANDLE_GET_LINE_VALUES_IOCTL:
        static_cast<gpiohandle_data*>(argument)->values[0] = static_cast<__u8>(value.load());
        return error;
      case GPIOHANDLE_SET_LINE_VALUES_IOCTL: value = static_cast<gpiohandle_data*>(argument)->values[0]; return error;
      default: return ENOTTY;
    }
  }

  static int open_line(std::uint32_t offset, int& fd) {
    if (offset == kTaken) {
      return EBUSY;
    }
    fd = open("/dev/gpioline0", O_RDWR);
    return fd < 0 ? errno : 0;
  }

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    const unsigned long request = umockdev_ioctl_client_get_request(client);
    UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
    UMockdevIoctlData* const data = umockdev_ioctl_data_resolve(argument, 0, _IOC_SIZE(request), nullptr);
    std::array<std::uint8_t, 2048> copy{};
    std::memcpy(copy.data(), data->data, _IOC_SIZE(request));
    const int failed = static_cast<ChipBelow*>(self)->answer(request, copy.data());
    umockdev_ioctl_data_update(data, 0, copy.data(), _IOC_SIZE(request));
    umockdev_ioctl_client_complete(client, failed == 0 ? 0 : -1, failed);
    umockdev_ioctl_data_unref(data);
    return TRUE;
  }

  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* handler_;
};

class LibgpiodAccessTest : public ::testing::Test {
 protected:
  Result<std::unique_ptr<GpioLine>> request(int offset, LineDirection direction, bool active_low = false) {
    return access_->request({"gpiochip0", offset, active_low, direction});
  }

  ChipBelow chip_;
  std::unique_ptr<LineAccess> access_ = make_libgpiod_access();
};

TEST_F(LibgpiodAccessTest, SetsAnOutput) {
  chip_.value = 1;
  const auto line = request(0, LineDirection::Output);
  ASSERT_TRUE(line) << line.error().message;
  EXPECT_EQ(chip_.value, 0) << "an output begins inactive";
  EXPECT_EQ(chip_.flags, static_cast<std::uint32_t>(GPIOHANDLE_REQUEST_OUTPUT));
  ASSERT_TRUE((*line)->set_active(true));
  EXPECT_EQ(chip_.value, 1);
  ASSERT_TRUE((*line)->set_active(false));
  EXPECT_EQ(chip_.value, 0);
  EXPECT_EQ((*line)->event_fd(), -1);
  EXPECT_FALSE((*line)->take_events().value());
}

TEST_F(LibgpiodAccessTest, AsksForLinesThatAreActiveLow) {
  ASSERT_TRUE(request(0, LineDirection::Output, true));
  EXPECT_EQ(chip_.flags, static_cast<std::uint32_t>(GPIOHANDLE_REQUEST_OUTPUT | GPIOHANDLE_REQUEST_ACTIVE_LOW));
  ASSERT_TRUE(request(1, LineDirection::Input, true));
  EXPECT_EQ(chip_.flags, static_cast<std::uint32_t>(GPIOHANDLE_REQUEST_INPUT | GPIOHANDLE_REQUEST_ACTIVE_LOW));
}

TEST_F(LibgpiodAccessTest, ReadsAnInputAndItsEvents) {
  const auto line = request(1, LineDirection::Input);
  ASSERT_TRUE(line) << line.error().message;
  EXPECT_GE((*line)->event_fd(), 0);
  EXPECT_FALSE((*line)->take_events().value());
  EXPECT_FALSE((*line)->is_active().value());
  chip_.value = 1;
  chip_.tell_event();
  chip_.tell_event();
  EXPECT_TRUE((*line)->take_events().value());
  EXPECT_FALSE((*line)->take_events().value());
  EXPECT_TRUE((*line)->is_active().value());
}

TEST_F(LibgpiodAccessTest, AnInputWithoutInterruptsIsReadAllTheSame) {
  const auto line = request(kNoInterrupt, LineDirection::Input);
  ASSERT_TRUE(line) << line.error().message;
  EXPECT_EQ((*line)->event_fd(), -1);
  chip_.value = 1;
  EXPECT_TRUE((*line)->is_active().value());
}

TEST_F(LibgpiodAccessTest, NamesWhoHasALine) {
  const auto line = request(kTaken, LineDirection::Input);
  ASSERT_FALSE(line);
  EXPECT_EQ(line.error().code, ErrorCode::Unavailable);
  EXPECT_EQ(line.error().message, "gpio: line 6 of gpiochip0 cannot be had, \"spi0 CS0\" has it: Device or resource busy");
}

TEST_F(LibgpiodAccessTest, NamesTheLinesThereAre) {
  const auto line = request(kLines, LineDirection::Output);
  ASSERT_FALSE(line);
  EXPECT_EQ(line.error().code, ErrorCode::NotFound);
  EXPECT_EQ(line.error().message, "gpio: line 8 of gpiochip0: the chip has 8 lines");
}

TEST_F(LibgpiodAccessTest, AChipThatVanishesIsAnError) {
  const auto line = request(1, LineDirection::Output);
  ASSERT_TRUE(line);
  chip_.error = ENODEV;
  const Status set = (*line)->set_active(true);
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::NotFound);
  EXPECT_EQ(set.error().message, "gpio: line 1 of gpiochip0 cannot be set: No such device");
  EXPECT_FALSE((*line)->is_active());
}

TEST_F(LibgpiodAccessTest, ListsChipsAndLines) {
  const auto chips = list_gpio_chips();
  ASSERT_TRUE(chips) << chips.error().message;
  ASSERT_EQ(chips->size(), 1U);
  EXPECT_EQ(chips->front().name, "gpiochip0");
  EXPECT_EQ(chips->front().label, "fake");
  ASSERT_EQ(chips->front().lines.size(), kLines);
  EXPECT_EQ(chips->front().lines[kTaken].name, "SPI_CE0");
  EXPECT_EQ(chips->front().lines[kTaken].consumer, "spi0 CS0");
  EXPECT_TRUE(chips->front().lines[kTaken].used);
  EXPECT_FALSE(chips->front().lines[0].used);
}

}  // namespace
}  // namespace posed

/// umockdev works from a library that is loaded before all others, so the program starts itself once more with it.
int main(int argc, char** argv) {
  if (umockdev_in_mock_environment() == 0 && getenv("LD_PRELOAD") == nullptr) {
    setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
    execv("/proc/self/exe", argv);
    std::perror("cannot start again");
    return EXIT_FAILURE;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
