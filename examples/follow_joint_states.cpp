// Follows a person's joint angles. Build: link rclcpp, sensor_msgs (ament_target_dependencies).
#include <chrono>
#include <memory>
#include <string>

#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/joint_state.hpp>

using sensor_msgs::msg::JointState;

class Follower : public rclcpp::Node {
 public:
  Follower() : Node("follower") {
    const auto id = declare_parameter<std::string>("subject", "subject");
    angles_ = create_subscription<JointState>(
        "/humans/bodies/" + id + "/joint_states", 10, [this](const JointState& message) {
          heard_ = true;
          for (size_t i = 0; i < message.name.size(); ++i) {
            if (message.name[i] == "left_elbow_flexion") {
              RCLCPP_INFO(get_logger(), "left_elbow_flexion %+.3f rad", message.position[i]);
            }
          }
        });
    stale_ = create_wall_timer(std::chrono::milliseconds(100), [this] {
      if (!heard_) RCLCPP_WARN(get_logger(), "stale: stop");
      heard_ = false;
    });
  }

 private:
  bool heard_ = false;
  rclcpp::Subscription<JointState>::SharedPtr angles_;
  rclcpp::TimerBase::SharedPtr stale_;
};

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<Follower>());
  rclcpp::shutdown();
}
