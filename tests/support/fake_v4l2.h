#pragma once

#include <cerrno>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include "drivers/v4l2/v4l2_system.h"

/// A kernel with cameras that exist only in a test. It keeps to what V4L2's documentation promises, and notes each call that a real
/// kernel would refuse. Descriptors and mappings are real ones, so that the process's own counts tell of leaks, too. Thread-bound.
namespace posed::test {

struct FakeFormat {
  std::uint32_t fourcc = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> sizes;
  std::uint32_t padding = 0;  ///< bytes behind each row
};

struct FakeControl {
  std::uint32_t id = 0;
  std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  std::string name;
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::uint64_t step = 1;
  std::uint32_t flags = 0;
  std::vector<std::string> menu;  ///< from `minimum` on; an empty text is a gap
  std::int64_t value = 0;
};

/// What becomes of one image.
struct FakeImage {
  bool dropped = false;       ///< never seen, but counted
  bool damaged = false;       ///< V4L2_BUF_FLAG_ERROR
  double filled = 1.0;        ///< share of its bytes
  TimeNs stamp_shift_ns = 0;  ///< added to its stamp
  TimeNs delay_ns = 0;        ///< added to the camera's own; later images wait behind it
};

struct FakeCamera {
  std::string card = "Fake camera";
  std::vector<FakeFormat> formats;
  double rate_hz = 30;  ///< the only one it has
  TimeNs delay_ns = 2 * kNsPerMs;
  TimeNs phase_ns = 0;  ///< when within a period images are taken
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::uint32_t stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  TimeNs clock_offset_ns = 0;  ///< its stamps less the monotonic clock
  std::uint32_t least_buffers = 2;
  std::uint32_t most_buffers = 32;
  bool extended_controls = true;                       ///< has VIDIOC_QUERY_EXT_CTRL
  std::function<void(v4l2_pix_format&)> twist_format;  ///< what the driver makes of a format beyond its own rules
  std::vector<FakeControl> controls;
  std::function<FakeImage(std::uint64_t sequence)> fate;
  std::function<void(std::uint64_t sequence, const v4l2_pix_format&, std::vector<std::uint8_t>& image)> paint;
};

class FakeKernel final : public V4l2System {
 public:
  explicit FakeKernel(const Clock& clock) : clock_(clock) {}
  ~FakeKernel() override;

  /// Its settings may be changed at any time.
  FakeCamera& plug(const std::string& path, FakeCamera camera);
  void unplug(const std::string& path);
  void replug(const std::string& path);

  void silence(const std::string& path, TimeNs until_ns);
  void break_streaming(const std::string& path, int error = EIO);          ///< of DQBUF, with POLLERR, until it is opened again
  void refuse(const std::string& path, unsigned long request, int error);  ///< the next such call; 0 as request: open
  void count_from(const std::string& path, std::uint64_t sequence);        ///< images of streams that begin from now on

  std::size_t open_descriptors() const { return files_.size(); }
  std::size_t mappings() const { return mappings_.size(); }
  std::size_t queued_buffers(const std::string& path) const;
  const std::vector<std::string>& violations() const { return violations_; }

  int open(const char* path) override;
  int close(int descriptor) override;
  int ioctl(int descriptor, unsigned long request, void* argument) override;
  int map(int descriptor, std::size_t length, std::uint32_t offset, void** address) override;
  int unmap(void* address, std::size_t length) override;
  int poll(std::span<pollfd> descriptors, TimeNs timeout_ns) override;

 private:
  struct Node {
    FakeCamera camera;
    bool present = true;
    std::uint64_t generation = 0;  // grows with each unplugging
    TimeNs silent_until_ns = 0;
    std::deque<std::pair<unsigned long, int>> refusals;
    std::uint64_t first_sequence = 0;
    int owner = -1;  // descriptor that has buffers
  };
  struct Buffer {
    bool queued = false;
    v4l2_buffer done{};
  };
  struct File {
    Node* node = nullptr;
    std::uint64_t generation = 0;
    v4l2_pix_format format{};
    bool streaming = false;
    int broken = 0;  // errno
    std::vector<Buffer> buffers;
    std::deque<std::uint32_t> queued;
    std::deque<std::uint32_t> done;
    std::uint64_t sequence = 0;
    TimeNs next_image_ns = 0;  // when it is taken
    std::vector<std::uint8_t> image;
  };
  struct Mapping {
    std::size_t length = 0;
    int descriptor = -1;
  };

  static bool is_alive(const File& file) { return file.node->present && file.generation == file.node->generation; }
  static TimeNs period_ns(const File& file) { return from_seconds(1.0 / file.node->camera.rate_hz); }
  static std::size_t buffer_stride(const File& file);

  void violation(const std::string& text) { violations_.push_back(text); }
  int take_refusal(Node& node, unsigned long request);
  int set_format(File& file, v4l2_format& format);
  int request_buffers(File& file, int descriptor, v4l2_requestbuffers& request);
  int query_buffer(const File& file, v4l2_buffer& buffer);
  int queue_buffer(File& file, v4l2_buffer& buffer);
  int dequeue_buffer(File& file, v4l2_buffer& buffer);
  int stream_on(File& file);
  int stream_off(File& file);
  int enumerate(const File& file, unsigned long request, void* argument) const;
  int control(File& file, unsigned long request, void* argument);
  int query_control(const FakeCamera& camera, v4l2_query_ext_ctrl& query) const;
  TimeNs arrival_of_next(File& file) const;
  void produce(File& file, int descriptor);
  short events_of(File& file, int descriptor);

  const Clock& clock_;
  std::map<std::string, std::unique_ptr<Node>> nodes_;
  std::map<int, File> files_;
  std::map<void*, Mapping> mappings_;
  std::vector<std::string> violations_;
};

}  // namespace posed::test
