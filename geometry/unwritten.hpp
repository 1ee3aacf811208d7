// An allocator whose vectors leave new elements as the memory was: a plan's room costs address space until it is
// written. The elements are of a trivial type, and who takes them writes before reading.
//
// Allocation   as of the allocator that it wraps
#pragma once

#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace moldloft::geometry {

template <typename Allocator>
class Unwritten : public Allocator {
  using Traits = std::allocator_traits<Allocator>;

 public:
  template <typename U>
  struct rebind {
    using other = Unwritten<typename Traits::template rebind_alloc<U>>;
  };

  using Allocator::Allocator;

  template <typename U>
  void construct(U* place) noexcept {
    static_assert(std::is_trivially_default_constructible_v<U>);
    ::new (static_cast<void*>(place)) U;
  }
  template <typename U, typename... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    Traits::construct(static_cast<Allocator&>(*this), place, std::forward<Arguments>(arguments)...);
  }
};

}  // namespace moldloft::geometry
