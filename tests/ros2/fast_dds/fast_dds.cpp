// Talker and listener on ROS 2 topics by Fast DDS alone: an implementation that is not Cyclone's.
//
//   fast_dds talk DOMAIN COUNT POINTS   clouds, odometry and paths, made with Fast CDR, at 10 Hz
//   fast_dds hear DOMAIN SECONDS        a line for each message: topic, frame, and what is in it
//
// Messages pass as bytes; what they say is written and read here, by the definitions of ROS 2.

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <chrono>
#include <cstdint>
#include <cstring>
#include <functional>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using Bytes = std::vector<char>;
using eprosima::fastcdr::Cdr;

constexpr uint32_t kMostBytes = 8u << 20;

// Any message, as the bytes that are sent.
class RawType : public fdds::TopicDataType {
public:
    explicit RawType(const std::string& name) {
        setName(name.c_str());
        m_typeSize = kMostBytes;
        m_isGetKeyDefined = false;
    }
    bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
        const auto& bytes = *static_cast<Bytes*>(data);
        payload->encapsulation = CDR_LE;
        payload->length = static_cast<uint32_t>(bytes.size());
        std::memcpy(payload->data, bytes.data(), bytes.size());
        return true;
    }
    bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
        auto* begin = reinterpret_cast<char*>(payload->data);
        static_cast<Bytes*>(data)->assign(begin, begin + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        auto size = static_cast<uint32_t>(static_cast<Bytes*>(data)->size());
        return [size] { return size; };
    }
    void* createData() override { return new Bytes; }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

struct Channel {
    const char* name;
    const char* type;
    bool reliable;
};
const Channel kClouds{"points", "sensor_msgs::msg::dds_::PointCloud2_", false};
const Channel kOdometry{"odom", "nav_msgs::msg::dds_::Odometry_", true};
const Channel kPaths{"path", "nav_msgs::msg::dds_::Path_", true};

// --- what messages say -------------------------------------------------------------------------

Bytes written(const std::function<void(Cdr&)>& write, size_t room) {
    Bytes bytes(room);
    eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
    Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    write(cdr);
    bytes.resize((cdr.getSerializedDataLength() + 3) & ~size_t{3});
    return bytes;
}

void header(Cdr& cdr, int32_t number, const std::string& frame) {
    cdr << number << uint32_t{0} << frame;
}

Bytes cloud(int32_t number, uint32_t points) {
    return written(
        [&](Cdr& cdr) {
            header(cdr, number, "lidar");
            cdr << uint32_t{1} << points << uint32_t{3};
            for (uint32_t axis = 0; axis < 3; ++axis)
                cdr << std::string(1, static_cast<char>('x' + axis)) << axis * 4 << uint8_t{7}
                    << uint32_t{1};
            cdr << false << uint32_t{12} << points * 12 << points * 12;
            std::vector<uint8_t> data(points * 12);
            for (uint32_t at = 0; at < points; ++at) {
                float place[3] = {static_cast<float>(at), 2.0f, 3.0f};
                std::memcpy(&data[at * 12], place, 12);
            }
            cdr.serializeArray(data.data(), data.size());
            cdr << true;
        },
        points * 12 + 1024);
}

void pose(Cdr& cdr, double x, double y, double z) {
    cdr << x << y << z << 0.0 << 0.0 << 0.0 << 1.0;
}

Bytes odometry(int32_t number) {
    return written(
        [&](Cdr& cdr) {
            header(cdr, number, "map");
            cdr << std::string("base_link");
            pose(cdr, number, 2.0, 3.0);
            for (int at = 0; at < 36; ++at) cdr << 0.0;
            cdr << 1.0 << 0.0 << 0.0 << 0.0 << 0.0 << 0.0;
            for (int at = 0; at < 36; ++at) cdr << 0.0;
        },
        2048);
}

Bytes path(int32_t number) {
    return written(
        [&](Cdr& cdr) {
            header(cdr, number, "map");
            cdr << uint32_t{2};
            for (int at = 0; at < 2; ++at) {
                header(cdr, number, "map");
                pose(cdr, number + at, 2.0, 3.0);
            }
        },
        2048);
}

void tell(const Channel& channel, Bytes& bytes) {
    eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    int32_t seconds;
    uint32_t nanoseconds, count, width;
    std::string frame, child;
    double x;
    cdr >> seconds >> nanoseconds >> frame;
    std::cout << channel.name << ' ' << frame << ' ' << seconds << ' ';
    if (&channel == &kClouds) {
        cdr >> count >> width;
        std::cout << count * width << ' ' << bytes.size() << std::endl;
    } else if (&channel == &kOdometry) {
        cdr >> child >> x;
        std::cout << child << ' ' << x << std::endl;
    } else {
        cdr >> count;
        std::cout << count << ' ' << 0 << std::endl;
    }
}

// --- both ends ---------------------------------------------------------------------------------

fdds::DomainParticipant* joined(int domain) {
    fdds::DomainParticipantQos qos;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    udp->receiveBufferSize = 4u << 20;
    udp->sendBufferSize = 4u << 20;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    for (uint32_t id = 0; id < 8; ++id) {
        rtps::Locator_t peer;
        rtps::IPLocator::setIPv4(peer, "127.0.0.1");
        peer.port = 7410 + 250 * domain + 2 * id;
        qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    }
    return fdds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

fdds::Topic* topic_of(fdds::DomainParticipant* participant, const Channel& channel) {
    fdds::TypeSupport type(new RawType(channel.type));
    type.register_type(participant);
    return participant->create_topic(
        "rt/" + std::string(channel.name), channel.type, fdds::TOPIC_QOS_DEFAULT);
}

const auto kRealloc = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;

int talk(int domain, int count, uint32_t points) {
    auto* participant = joined(domain);
    auto* publisher = participant->create_publisher(fdds::PUBLISHER_QOS_DEFAULT);
    std::vector<fdds::DataWriter*> writers;
    for (const auto* channel : {&kClouds, &kOdometry, &kPaths}) {
        fdds::DataWriterQos qos;
        qos.endpoint().history_memory_policy = kRealloc;
        qos.history().depth = 5;
        qos.publish_mode().kind = fdds::ASYNCHRONOUS_PUBLISH_MODE;
        qos.reliability().kind = channel->reliable ? fdds::RELIABLE_RELIABILITY_QOS
                                                   : fdds::BEST_EFFORT_RELIABILITY_QOS;
        writers.push_back(publisher->create_datawriter(topic_of(participant, *channel), qos));
    }
    for (auto* writer : writers) {
        fdds::PublicationMatchedStatus status;
        for (int tick = 0; tick < 600; ++tick) {
            writer->get_publication_matched_status(status);
            if (status.current_count > 0) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
        }
    }
    std::this_thread::sleep_for(std::chrono::seconds(1));
    for (int number = 1; number <= count; ++number) {
        Bytes messages[] = {cloud(number, points), odometry(number), path(number)};
        for (size_t at = 0; at < 3; ++at) writers[at]->write(&messages[at]);
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    std::this_thread::sleep_for(std::chrono::seconds(2));
    return 0;
}

int hear(int domain, double seconds) {
    auto* participant = joined(domain);
    auto* subscriber = participant->create_subscriber(fdds::SUBSCRIBER_QOS_DEFAULT);
    const Channel* channels[] = {&kClouds, &kOdometry, &kPaths};
    std::vector<fdds::DataReader*> readers;
    for (const auto* channel : channels) {
        fdds::DataReaderQos qos;
        qos.endpoint().history_memory_policy = kRealloc;
        qos.history().depth = 20;
        qos.reliability().kind = channel->reliable ? fdds::RELIABLE_RELIABILITY_QOS
                                                   : fdds::BEST_EFFORT_RELIABILITY_QOS;
        readers.push_back(subscriber->create_datareader(topic_of(participant, *channel), qos));
    }
    std::cout << "ready" << std::endl;
    auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    Bytes bytes;
    fdds::SampleInfo info;
    while (std::chrono::steady_clock::now() < until) {
        for (size_t at = 0; at < 3; ++at)
            while (readers[at]->take_next_sample(&bytes, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
                if (info.valid_data) tell(*channels[at], bytes);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return 0;
}

int main(int count, char** words) {
    const std::string what = count > 3 ? words[1] : "";
    if (what == "talk" && count == 5)
        return talk(std::stoi(words[2]), std::stoi(words[3]), std::stoul(words[4]));
    if (what == "hear") return hear(std::stoi(words[2]), std::stod(words[3]));
    std::cerr << "fast_dds talk DOMAIN COUNT POINTS | fast_dds hear DOMAIN SECONDS\n";
    return 2;
}
