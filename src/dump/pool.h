#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <vector>

namespace vlx {

/// Objects that keep their memory from task to task. A task borrows one and gives it back by dropping it;
/// there are as many as tasks ran at once.
template <class T>
class Pool {
  public:
    explicit Pool(std::function<std::unique_ptr<T>()> make) : make_(std::move(make)) {}

    struct GiveBack {
        Pool* pool;
        void operator()(T* object) const {
            const std::lock_guard lock(pool->mutex_);
            pool->free_.emplace_back(object);
        }
    };
    using Lease = std::unique_ptr<T, GiveBack>;

    Lease borrow() {
        {
            const std::lock_guard lock(mutex_);
            if (!free_.empty()) {
                Lease lease(free_.back().release(), GiveBack{this});
                free_.pop_back();
                return lease;
            }
        }
        return Lease(make_().release(), GiveBack{this});
    }

  private:
    const std::function<std::unique_ptr<T>()> make_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<T>> free_;
};

}  // namespace vlx
