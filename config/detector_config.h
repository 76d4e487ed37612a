#pragma once

#include <string>
#include <vector>

/// The part of the configuration (config/config.h) that the detector of people goes by.
namespace posed {

enum class DetectorEngine {
  Posed,   ///< the project's runner, which can be stopped between any two of its steps
  OpenCv,  ///< OpenCV's DNN module
};

enum class DetectorHead { Anchors, Boxes, Yolox };  ///< detect/box_decoder.h

struct DetectorConfig {
  bool enabled = true;
  /// config/model_name.h; from cheap to costly.
  std::vector<std::string> models{"person.posednet@192x160", "person.posednet@256x192", "person.posednet@320x256",
                                  "person.posednet@384x288", "person.posednet@384x288+320x256"};
  double budget_s = 0.033;  ///< after which a frame is given up (not in lockstep)
  int lockstep_model = 2;   ///< index into `models`, of the one that looks in lockstep
  double score = 0.34;      ///< least confidence
  double memory_s = 1.0;    ///< in which it fades that somebody was surely seen; 0: each image by itself
  double iou = 0.5;         ///< of two boxes that overlap by more, one goes
  DetectorEngine engine = DetectorEngine::Posed;
  DetectorHead head = DetectorHead::Anchors;
  int person_class = 0;  ///< of the model's classes
};

}  // namespace posed
