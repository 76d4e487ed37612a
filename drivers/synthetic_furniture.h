#pragma once

#include <cstdint>
#include <span>

#include "drivers/synthetic_scene_builder.h"

namespace posed {

/// Pieces that stand at a wall, at most 0.5 m deep and 1.75 m wide.
enum class Furniture { Bookshelf, Desk, Cabinet, Cartons, LowShelf, Sofa, Chairs };

void shuffle(std::span<Furniture> pieces, HashRng& rng);

/// Furnishes a scene: pieces, pictures, doors, drawn from the builder's random numbers and made of the same sheets of wood, board,
/// books, cloth and metal. A slot is a place at a wall, its x along the wall. Thread-bound.
class Furnisher {
 public:
  /// Paints the sheets. `builder` must outlive the furnisher.
  explicit Furnisher(SceneBuilder& builder);

  /// Puts a piece against the wall; its height [m], above which pictures can hang.
  float furnish(const Place& slot, Furniture kind);

  /// A piece at `x` along the wall, and one or two pictures between it and the height `pictures_to_m`.
  void furnish_below_pictures(const Place& wall, float x, Furniture kind, float pictures_to_m);

  void desk(const Place& slot);
  void chair(const Place& place);

  /// Hang on the wall, `x` along it, with the lower edge at `z`.
  void picture(const Place& wall, float x, float z, float width, float height);
  void notice_board(const Place& wall, float x, float z, float width, float height);

  /// A closed door in its frame, 1.1 m wide.
  void door(const Place& wall, float x);

  /// An office's movable wall, along the place's x, with papers on both sides.
  void partition(const Place& place, float width, float height);

 private:
  void board(const Place& wall, float x, float z, Eigen::Vector2f size);
  void bookshelf(const Place& slot, float width, float height, int rows);
  void cabinet(const Place& slot, float width);
  void cartons(const Place& slot);
  void sofa(const Place& slot);
  void pile(const Place& place, float z, float width, float depth, int levels);

  SceneBuilder& builder_;
  HashRng& rng_;
  std::uint32_t wood_;
  std::uint32_t cardboard_;
  std::uint32_t covers_;
  std::uint32_t upholstery_;
  std::uint32_t metal_;
};

}  // namespace posed
