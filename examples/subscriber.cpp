// Prints the poses that posed publishes. Build: cmake -B build && cmake --build build; run: build/subscriber [LCM_URL [COUNT]]
#include <cstdio>
#include <cstdlib>

#include <lcm/lcm-cpp.hpp>
#include <posed/pose_t.hpp>

namespace {

void print_pose(const lcm::ReceiveBuffer*, const std::string&, const posed::pose_t* pose, int* left) {
  if (pose->state == posed::pose_t::STATE_TRACKING) {
    const double* t = pose->T_map_base.position;
    std::printf("%lld %.3f %.3f %.3f, %d inliers\n", static_cast<long long>(pose->utime), t[0], t[1], t[2], pose->inliers);
  } else {
    std::printf("%lld no pose, state %d\n", static_cast<long long>(pose->utime), pose->state);
  }
  std::fflush(stdout);
  *left -= *left > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  lcm::LCM lcm(argc > 1 ? argv[1] : "udpm://239.255.76.67:7667?ttl=0");
  int left = argc > 2 ? std::atoi(argv[2]) : -1;  // poses to print; negative: no end
  if (!lcm.good()) {
    std::fprintf(stderr, "LCM cannot start: is there a multicast route?\n");
    return 1;
  }
  lcm.subscribeFunction("POSED_POSE", print_pose, &left);
  while (left != 0 && lcm.handle() == 0) {
  }
  return 0;
}
